"""Which matches are right, where the true homography is known."""

from torch import Tensor

from diffnav.geometry.homography import apply_homography
from diffnav.matching.matches import Matches


def match_errors_px(matches: Matches, H_a_b: Tensor) -> Tensor:
    """Distance in image b between where each match is and where H_a_b (3, 3) says it should be: (M,) float64."""
    return (apply_homography(H_a_b, matches.points_a) - matches.points_b.double()).norm(dim=-1)


def correct_matches(matches: Matches, H_a_b: Tensor, threshold_px: float = 3.0) -> Tensor:
    """Which matches lie within `threshold_px` (inclusive) of the truth: (M,) bool."""
    return match_errors_px(matches, H_a_b) <= threshold_px
