"""Homographies in the plane: `H_a_b` (3, 3) maps column points (x, y, 1) of image a to image b.

Points are (..., N, 2) as x, y in pixels, integer coordinates at pixel centres; results are float64.
"""

import math
from typing import NamedTuple

import torch
from torch import Tensor

# Of the largest term that makes up a point's scale: below it only rounding is left.
_VANISHING = 1e-14
# Points closer together than this cannot be told apart, pixels.
_SMALLEST_SPREAD_PX = 1e-3
# Of the normal equations, whose diagonal is of order 1 in normalised coordinates: too little to bend a sound fit.
_DAMPING = 1e-10
# Of their smallest eigenvalue: below it the points do not determine a homography.
_DETERMINED = 1e-6


class HomographyFit(NamedTuple):
    """H (B, 3, 3) float64, always finite; determined (B,) bool: whether the points say where all of the plane goes."""

    H: Tensor
    determined: Tensor


def fit_homography(points_a: Tensor, points_b: Tensor, weights: Tensor) -> HomographyFit:
    """The homographies H_a_b that map points a onto points b with the least weighted algebraic error.

    Args:
        points_a, points_b: (B, N, 2) corresponding pixels. weights: (B, N) >= 0; zero drops a pair.
    Returns: H with H[2, 2] = 1 at the centres of the points, and which fits are determined. Points that are
        collinear, coincident, fewer than four or all of weight zero leave H free in part: there it stays the
        similarity that takes centre to centre and spread to spread. Differentiable in all arguments, finite always.
    Source: Hartley 1997 (normalisation); Hartley & Zisserman, 2nd ed., section 4.1 (inhomogeneous solution), damped.
    """
    points_a, points_b, weights = points_a.double(), points_b.double(), weights.double()
    share = (weights / weights.sum(1, keepdim=True).clamp(min=1e-12))[..., None]
    (T_a, a), (T_b, b) = _normalised(points_a, share), _normalised(points_b, share)
    ones, zeros = torch.ones_like(a[..., :1]), torch.zeros_like(a)
    x_rows = torch.cat([a, ones, zeros, zeros[..., :1], -b[..., :1] * a], -1)
    y_rows = torch.cat([zeros, zeros[..., :1], a, ones, -b[..., 1:] * a], -1)
    rows, values = torch.cat([x_rows, y_rows], 1), torch.cat([b[..., 0], b[..., 1]], 1)[..., None]
    weighted = rows * torch.cat([share, share], 1)
    M = weighted.mT @ rows
    identity = M.new_tensor([1, 0, 0, 0, 1, 0, 0, 0])[:, None]
    damped = M + _DAMPING * torch.eye(8, dtype=M.dtype, device=M.device)
    h = identity + torch.cholesky_solve(weighted.mT @ (values - rows @ identity), torch.linalg.cholesky(damped))
    H = torch.cat([h[..., 0], torch.ones_like(h[:, :1, 0])], 1).reshape(-1, 3, 3)
    determined = torch.linalg.eigvalsh(M.detach())[:, 0] > _DETERMINED
    # T_b is a scale and a shift, so its inverse exists and needs no solver.
    return HomographyFit(_inverse_of_scale_and_shift(T_b) @ H @ T_a, determined)


def _normalised(points: Tensor, share: Tensor) -> tuple[Tensor, Tensor]:
    """T (B, 3, 3) that moves the points' weighted centre to 0 and their root mean square distance to sqrt(2)."""
    centre = (share * points).sum(1, keepdim=True)
    moved = points - centre
    spread = (share * moved.square()).sum((1, 2)).clamp(min=_SMALLEST_SPREAD_PX**2).sqrt()
    scale = math.sqrt(2) / spread
    zero, one = torch.zeros_like(scale), torch.ones_like(scale)
    x, y = (-scale * centre[:, 0, axis] for axis in (0, 1))
    T = torch.stack([scale, zero, x, zero, scale, y, zero, zero, one], -1).reshape(-1, 3, 3)
    return T, moved * scale[:, None, None]


def _inverse_of_scale_and_shift(T: Tensor) -> Tensor:
    scale = T[:, 0, 0]
    zero, one = torch.zeros_like(scale), torch.ones_like(scale)
    x, y = (-T[:, axis, 2] / scale for axis in (0, 1))
    return torch.stack([1 / scale, zero, x, zero, 1 / scale, y, zero, zero, one], -1).reshape(-1, 3, 3)


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


def corners_of(size: tuple[int, int]) -> Tensor:
    """The outermost pixels' centres of an image of `size` (h, w): (4, 2) float64, clockwise from the top left."""
    height, width = size
    return torch.tensor([[0, 0], [width - 1, 0], [width - 1, height - 1], [0, height - 1]], dtype=torch.float64)


def homography_corner_error_px(H_estimated: Tensor | None, H_true: Tensor, size: tuple[int, int]) -> float:
    """Mean distance in image b between where two homographies (3, 3) put the four corners of image a.

    The corners are the outermost pixels' centres of a's `size` (h, w). Infinite where nothing was estimated (None).
    Source: DeTone et al. 2016, section 4; HPatches' homography estimation.
    """
    if H_estimated is None:
        return math.inf
    corners = corners_of(size).to(H_true.device)
    distances = (apply_homography(H_estimated, corners) - apply_homography(H_true, corners)).norm(dim=-1)
    return distances.mean().item()


def rotation_180(size: tuple[int, int]) -> Tensor:
    """H (3, 3) float64 that turns an image of `size` (h, w) by 180 degrees: x' = w - 1 - x, y' = h - 1 - y."""
    height, width = size
    return torch.tensor([[-1, 0, width - 1], [0, -1, height - 1], [0, 0, 1]], dtype=torch.float64)


def rotate_180(image: Tensor) -> Tensor:
    """The image (..., H, W) turned by 180 degrees, exactly; `rotation_180` maps its points, both ways."""
    return image.flip(-2, -1)
