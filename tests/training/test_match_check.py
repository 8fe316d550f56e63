"""Matches counted while training goes on: against known matches, and what the picture of them shows."""

import torch
from tiny_training import picture

from diffnav.geometry.homography import rotate_180
from diffnav.images import from_uint8
from diffnav.matching.matches import Features, Matches
from diffnav.matching.sift import Sift
from diffnav.training.match_check import MatchCheck, draw_matches

SIZE = (96, 120)


class Known:
    """Two right matches, one 3 px off, one 4 px off; counts how often it looks at a picture."""

    name = "known"

    def __init__(self) -> None:
        self.settings: dict = {}
        self.pictures: list[torch.Tensor] = []

    def features(self, image: torch.Tensor) -> Features:
        self.pictures.append(image)
        return Features(torch.zeros(0, 2), torch.zeros(0, 1), torch.zeros(0), SIZE)

    def match(self, a: Features, b: Features) -> Matches:  # noqa: ARG002
        points = torch.tensor([[10.0, 20], [50, 60], [70, 30], [90, 40]])
        turned = torch.tensor([119.0, 95]) - points
        off = torch.tensor([[0.0, 0], [0, 0], [0, 3], [4, 0]])
        return Matches(points, turned + off, torch.ones(4), self.name, {})


def test_counts_what_lies_within_three_pixels_of_half_a_turn() -> None:
    matcher = Known()
    check = MatchCheck(matcher)
    enhanced, normal = from_uint8(picture(0, *SIZE)), from_uint8(picture(1, *SIZE))
    count, lines = check(0, enhanced, normal)
    assert count == 3
    assert lines.shape == (3, SIZE[0], 2 * SIZE[1])
    assert {tuple(p.flatten()[:9].tolist()) for p in matcher.pictures} == {
        tuple(p.flatten()[:9].tolist()) for p in (normal, rotate_180(enhanced))
    }
    check(0, enhanced, normal)
    assert len(matcher.pictures) == 3, "the reference was looked at twice"


def test_a_picture_matches_itself() -> None:
    image = from_uint8(picture(0, *SIZE))
    count, _ = MatchCheck(Sift())(0, image, image)
    assert count > 50


def test_lines_are_green_where_right_and_red_where_not() -> None:
    grey = torch.full((3, *SIZE), 0.5)
    points = torch.tensor([[10.0, 20], [10, 80]])
    matches = Matches(points, points, torch.ones(2), "known", {})
    lines = draw_matches(grey, grey, matches, torch.tensor([True, False]))
    assert lines[:, 20, 60].tolist() == [0, 200 / 255, 0] or lines[1, 20, 60] > lines[0, 20, 60] + 0.5
    assert lines[0, 80, 60] > lines[1, 80, 60] + 0.5
    assert lines[0, 50, 60] == lines[1, 50, 60]
