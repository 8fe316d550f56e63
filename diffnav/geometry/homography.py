"""Homographies in the plane: `H_a_b` (3, 3) maps column points (x, y, 1) of image a to image b.

Points are (..., N, 2) as x, y in pixels, integer coordinates at pixel centres; results are float64.
"""

import math

import torch
from torch import Tensor

# Of the largest term that makes up a point's scale: below it only rounding is left.
_VANISHING = 1e-14


def apply_homography(H_a_b: Tensor, points: Tensor) -> Tensor:
    """The points of image a as they appear in image b: (..., N, 2) float64.

    Args:
        H_a_b: (..., 3, 3), maps a to b; its scale does not matter.
        points: (..., N, 2) pixels of a; leading dimensions broadcast against those of H_a_b.
    Returns: pixels of b; differentiable in both. A point on the line that H_a_b sends to infinity comes out finite
        but very far away, with finite gradients.
    Raises: ValueError for other shapes.
    """
    if H_a_b.shape[-2:] != (3, 3) or points.ndim < 2 or points.shape[-1] != 2:
        raise ValueError(
            f"need H (..., 3, 3) and points (..., N, 2), got {tuple(H_a_b.shape)} and {tuple(points.shape)}"
        )
    H, points = H_a_b.double(), points.double()
    mapped = points @ H[..., :2].mT + H[..., None, :, 2]
    scale = mapped[..., 2:]
    # Shielded before the division: a `where` after it would still let NaN into the gradient.
    terms = torch.cat([points * H[..., None, 2, :2], H[..., None, 2, 2:].expand_as(scale)], -1)
    smallest = _VANISHING * terms.detach().abs().amax(-1, keepdim=True)
    smallest = smallest.clamp(min=1e-100)
    shielded = torch.where(scale < 0, -smallest, smallest)
    return mapped[..., :2] / torch.where(scale.abs() < smallest, shielded, scale)


def homography_corner_error_px(H_estimated: Tensor | None, H_true: Tensor, size: tuple[int, int]) -> float:
    """Mean distance in image b between where two homographies (3, 3) put the four corners of image a.

    The corners are the outermost pixels' centres of a's `size` (h, w). Infinite where nothing was estimated (None).
    Source: DeTone et al. 2016, section 4; HPatches' homography estimation.
    """
    if H_estimated is None:
        return math.inf
    height, width = size
    corners = H_true.new_tensor([[0, 0], [width - 1, 0], [width - 1, height - 1], [0, height - 1]], dtype=torch.float64)
    distances = (apply_homography(H_estimated, corners) - apply_homography(H_true, corners)).norm(dim=-1)
    return distances.mean().item()


def rotation_180(size: tuple[int, int]) -> Tensor:
    """H (3, 3) float64 that turns an image of `size` (h, w) by 180 degrees: x' = w - 1 - x, y' = h - 1 - y."""
    height, width = size
    return torch.tensor([[-1, 0, width - 1], [0, -1, height - 1], [0, 0, 1]], dtype=torch.float64)


def rotate_180(image: Tensor) -> Tensor:
    """The image (..., H, W) turned by 180 degrees, exactly; `rotation_180` maps its points, both ways."""
    return image.flip(-2, -1)
