"""Windows onto the world plane: homographies from pixels to metres, and what each pixel covers."""

import math

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from diffnav.errors import UserError

LIMIT_M = 1e9
Size = tuple[int, int]


def window_homography(
    centre_m: tuple[float, float], ground_sample_distance_m: float, heading_deg: float, size: Size
) -> Tensor:
    """H_image_world (3, 3) float64 of a straight-down window: pixels to metres east and north.

    Args:
        centre_m: world position of the window's middle, east and north.
        ground_sample_distance_m: metres per pixel, above 0.
        heading_deg: direction of the image's top, clockwise from north.
        size: (h, w) pixels.

    Raises: UserError for a size below 1 x 1 or a ground sample distance that is not above 0.
    """
    if not (math.isfinite(ground_sample_distance_m) and ground_sample_distance_m > 0):
        raise UserError(f"ground_sample_distance_m must be above 0, got {ground_sample_distance_m}.")
    h, w = checked_size(size)
    c, s = (f(math.radians(heading_deg)) * ground_sample_distance_m for f in (math.cos, math.sin))
    x, y = centre_m
    mid_x, mid_y = (w - 1) / 2, (h - 1) / 2
    # Right is (cos, -sin) and up is (sin, cos) in (east, north); image y runs down.
    rows = [[c, -s, x - c * mid_x + s * mid_y], [-s, -c, y + s * mid_x + c * mid_y], [0.0, 0.0, 1.0]]
    return torch.tensor(rows, dtype=torch.float64)


def checked_size(size: Size) -> Size:
    """(h, w) as integers. Raises: UserError if either is not a whole number of 1 or more."""
    h, w = size
    if int(h) != h or int(w) != w or h < 1 or w < 1:
        raise UserError(f"a window needs a size of 1 x 1 pixels or more, got {size} (h, w).")
    return int(h), int(w)


def checked_view(H_image_world: Tensor | NDArray, h: int, w: int) -> NDArray:
    """H_image_world (3, 3) float64, found fit to render. Raises: UserError if it is not."""
    H = np.asarray(H_image_world, np.float64)
    if H.shape != (3, 3) or not np.isfinite(H).all():
        raise UserError(f"H_image_world must be a finite 3 x 3 matrix, got {H.tolist()}.")
    corners = np.array([[0, w - 1, 0, w - 1], [0, 0, h - 1, h - 1], [1, 1, 1, 1]], np.float64)
    x, y, scale = H @ corners
    if scale.min() * scale.max() <= 0:
        raise UserError("the window reaches the horizon; tilt it less or make it smaller.")
    # Free of the translation, which may be a million metres and says nothing about the rank.
    linear = H[:2, :2] - np.outer(H[:2, 2], H[2, :2]) / H[2, 2]
    if abs(np.linalg.det(linear)) <= 1e-9 * np.square(linear).sum():
        raise UserError("H_image_world is singular; give a homography that can be inverted.")
    if max(np.abs(x / scale).max(), np.abs(y / scale).max()) > LIMIT_M:
        raise UserError(f"the window lies beyond {LIMIT_M:.0e} m from the origin, where positions lose precision.")
    return H


def ground_points(H_image_world: NDArray, px: NDArray, py: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """World x, y (N,) float64 of pixels, and the side (N,) float32 of the ground patch each covers, m."""
    x, y, scale = H_image_world @ np.stack([px, py, np.ones_like(px)]).astype(np.float64)
    # The determinant of a homography's Jacobian is det(H) / scale^3.
    area = abs(np.linalg.det(H_image_world)) / np.abs(scale) ** 3
    return x / scale, y / scale, np.sqrt(area).astype(np.float32)
