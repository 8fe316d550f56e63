"""How sure a place is: the covariance that inliers' residuals leave to a fitted homography."""

import torch
from torch import Tensor

from diffnav.geometry.homography import apply_homography

# Of the largest eigenvalue of J^T J: below it there is rounding.
_LEAST = 1e-12


def point_covariance(H_a_b: Tensor, points_a: Tensor, points_b: Tensor, place: Tensor) -> Tensor:
    """Covariance (2, 2) in px^2 of where `place` (2,) of image a lies in image b.

    H_a_b (3, 3) was fitted to points_a, points_b (M, 2), M >= 5, whose errors are taken to be independent, equal in x
    and y, and those of image b alone.

    Source: Hartley & Zisserman, 2nd ed., sections 5.1.3 and 5.2.3: sigma^2 (J^T J)^-1, carried on to the place.
    """
    to_a, to_b = _frame(points_a), _frame(points_b)
    H = torch.linalg.inv(to_b) @ H_a_b.double() @ to_a
    H = H / H[2, 2]
    a, b = (apply_homography(torch.linalg.inv(to), points) for to, points in ((to_a, points_a), (to_b, points_b)))
    J = _jacobian(H, a).reshape(-1, 8)
    variance = (apply_homography(H, a) - b).square().sum() / max(2 * len(a) - 8, 1)
    values, directions = torch.linalg.eigh(J.T @ J)
    # What the points leave open must come out unsure: a pseudo-inverse would call it certain.
    covariance = variance * (directions / values.clamp(min=_LEAST * float(values[-1]))) @ directions.T
    there = _jacobian(H, apply_homography(torch.linalg.inv(to_a), place[None]))[0]
    return to_b[0, 0] ** 2 * there @ covariance @ there.T


def _frame(points: Tensor) -> Tensor:
    """(3, 3) from coordinates of order 1 about the points (M, 2) to these: J^T J holds products of four of them."""
    middle = points.double().mean(0)
    spread = (points.double() - middle).square().mean().sqrt().clamp(min=1e-6)
    frame = torch.diag(torch.stack([spread, spread, torch.ones_like(spread)]))
    frame[:2, 2] = middle
    return frame


def _jacobian(H: Tensor, points: Tensor) -> Tensor:
    """(N, 2, 8) derivatives of mapped points (N, 2) by H's first eight entries, H[2, 2] = 1."""
    mapped = apply_homography(H, points)
    ones, zeros = torch.ones_like(points[:, :1]), torch.zeros_like(points)
    row = torch.cat([points, ones], 1)
    nothing = torch.cat([zeros, zeros[:, :1]], 1)
    x = torch.cat([row, nothing, -mapped[:, :1] * points], 1)
    y = torch.cat([nothing, row, -mapped[:, 1:] * points], 1)
    divisor = points @ H[2, :2] + H[2, 2]
    return torch.stack([x, y], 1) / divisor[:, None, None]
