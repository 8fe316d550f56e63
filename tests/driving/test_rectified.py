import torch

from diffnav.driving.rectified import matches_on_a_row
from diffnav.matching.matches import Matches


def test_matches_within_one_and_a_half_rows_count() -> None:
    a = torch.tensor([[10.0, 20.0], [30.0, 40.0], [50.0, 60.0], [70.0, 80.0]])
    b = torch.tensor([[4.0, 20.0], [25.0, 41.5], [49.0, 58.4], [70.0, 81.6]])
    assert matches_on_a_row(Matches(a, b, torch.ones(4), "sift", {})) == 2
    assert matches_on_a_row(Matches(a[:0], b[:0], torch.ones(0), "sift", {})) == 0
