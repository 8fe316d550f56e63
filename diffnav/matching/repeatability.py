"""How many keypoints of two pictures lie on one another, where the true homography is known."""

import torch
from torch import Tensor

from diffnav.geometry.homography import apply_homography
from diffnav.geometry.views import inside
from diffnav.matching.matches import Features


def repeatability(
    a: Features, b: Features, H_a_b: Tensor, visible_a: Tensor | None = None, threshold_px: float = 3.0
) -> float | None:
    """The share of covisible keypoints of a and of b with a counterpart within `threshold_px`: in [0, 1].

    A keypoint is covisible if the other image shows its place; several at one position are one. Distances are taken
    in image b. None where no keypoint is covisible, as for a matcher without keypoints.

    Args: H_a_b (3, 3). visible_a: (h, w) bool, the pixels of a that show the scene; None for all.
    Source: DeTone et al. 2018, section 7.1, over both images' keypoints together.
    """
    points_a, points_b = (features.keypoints.double().unique(dim=0) for features in (a, b))
    a_in_b = apply_homography(H_a_b, points_a)
    b_in_a = apply_homography(torch.linalg.inv(H_a_b.double()), points_b)
    seen_a = inside(a_in_b, b.size) & are_visible(points_a, visible_a)
    seen_b = inside(b_in_a, a.size) & are_visible(b_in_a, visible_a)
    count = int(seen_a.sum() + seen_b.sum())
    if count == 0:
        return None
    close = torch.cdist(a_in_b, points_b) <= threshold_px
    return int(close[seen_a].any(1).sum() + close[:, seen_b].any(0).sum()) / count


def are_visible(points: Tensor, visible: Tensor | None) -> Tensor:
    """Which of the points (N, 2) lie on a pixel of which `visible` (h, w) is true: (N,) bool; all if it is None."""
    if visible is None:
        return torch.ones(len(points), dtype=torch.bool)
    x, y = points.round().long().unbind(1)
    height, width = visible.shape
    within = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    return within & visible[y.clamp(0, height - 1), x.clamp(0, width - 1)]
