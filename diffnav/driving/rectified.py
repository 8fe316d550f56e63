"""What a rectified pair of cameras knows beforehand: a point lies on the same row in both pictures of one moment."""

from diffnav.matching.matches import Matches

# Rectification and keypoints are good to about half a pixel.
ROW_PX = 1.5


def matches_on_a_row(matches: Matches) -> int:
    """How many matches keep their row, within 1.5 px.

    A car that has driven on moves points off their rows; another moment has no such epipolar lines, while a fundamental
    matrix fitted to its matches would explain it as well.
    """
    return int(((matches.points_a[:, 1] - matches.points_b[:, 1]).abs() <= ROW_PX).sum())
