"""The embedded world: an endless, seeded landscape seen from straight above, rendered at any scale and heading.

Tests, the demo and some training draw their "photographs", maps and exact homographies from it; nothing is
downloaded. The colour of a place depends on the seed, the place and the size of a pixel there alone, so two windows
over one place agree, whatever was rendered before. World frame: metres, x east, y north. Image frame: pixels, x
right, y down, integer coordinates at pixel centres.
"""

import math
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from diffnav.data.scenery.paint import colours
from diffnav.errors import UserError

CHUNK = 40_000
LIMIT_M = 1e9
Size = tuple[int, int]


def window_homography(
    centre_m: tuple[float, float], ground_sample_distance_m: float, heading_deg: float, size: Size
) -> Tensor:
    """H_image_world (3, 3) float64 of a straight-down window: pixels to metres east and north.

    Args:
        centre_m: world position of the window's middle. ground_sample_distance_m: metres per pixel, > 0.
        heading_deg: direction of the image's top, clockwise from north. size: (h, w) pixels.
    """
    if not (math.isfinite(ground_sample_distance_m) and ground_sample_distance_m > 0):
        raise UserError(f"ground_sample_distance_m must be above 0, got {ground_sample_distance_m}.")
    h, w = _checked(size)
    c, s = (f(math.radians(heading_deg)) * ground_sample_distance_m for f in (math.cos, math.sin))
    x, y = centre_m
    mid_x, mid_y = (w - 1) / 2, (h - 1) / 2
    # Right is (cos, -sin) and up is (sin, cos) in (east, north); image y runs down.
    rows = [[c, -s, x - c * mid_x + s * mid_y], [-s, -c, y + s * mid_x + c * mid_y], [0.0, 0.0, 1.0]]
    return torch.tensor(rows, dtype=torch.float64)


def _checked(size: Size) -> Size:
    h, w = size
    if int(h) != h or int(w) != w or h < 1 or w < 1:
        raise UserError(f"a window needs a size of 1 x 1 pixels or more, got {size} (h, w).")
    return int(h), int(w)


@dataclass(frozen=True)
class World:
    """An endless landscape; equal seeds give equal worlds, and every world has its own fields, roads and houses."""

    seed: int = 0

    def render(
        self,
        centre_m: tuple[float, float] = (0.0, 0.0),
        ground_sample_distance_m: float = 0.2,
        heading_deg: float = 0.0,
        size: Size = (400, 600),
    ) -> Tensor:
        """(3, h, w) float32 RGB in [0, 1]: the window that `window_homography` describes."""
        return self.render_homography(window_homography(centre_m, ground_sample_distance_m, heading_deg, size), size)

    def render_homography(self, H_image_world: Tensor | np.ndarray, size: Size) -> Tensor:
        """(3, h, w) float32 RGB in [0, 1]: the world plane seen through any homography, pixels to metres.

        Raises: UserError if H_image_world is singular or the window reaches the horizon.
        """
        h, w = _checked(size)
        H = np.asarray(H_image_world, np.float64)
        if H.shape != (3, 3) or not np.isfinite(H).all():
            raise UserError(f"H_image_world must be a finite 3 x 3 matrix, got shape {H.shape}.")
        _check_view(H, h, w)
        image = np.empty((3, h * w), np.float32)
        for start in range(0, h * w, CHUNK):
            pixel = np.arange(start, min(start + CHUNK, h * w))
            x, y, footprint_m = _ground_points(H, pixel % w, pixel // w)
            image[:, start : start + CHUNK] = colours(self.seed, x, y, footprint_m)
        return torch.from_numpy(image.reshape(3, h, w))


def _ground_points(H_image_world: np.ndarray, px: np.ndarray, py: np.ndarray) -> tuple[np.ndarray, ...]:
    """World x, y (float64) of pixels and the side of the ground patch each covers (float32), metres."""
    x, y, scale = H_image_world @ np.stack([px, py, np.ones_like(px)]).astype(np.float64)
    # The determinant of a homography's Jacobian is det(H) / scale^3.
    area = abs(np.linalg.det(H_image_world)) / np.abs(scale) ** 3
    return x / scale, y / scale, np.sqrt(area).astype(np.float32)


def _check_view(H_image_world: np.ndarray, h: int, w: int) -> None:
    corners = np.array([[0, w - 1, 0, w - 1], [0, 0, h - 1, h - 1], [1, 1, 1, 1]], np.float64)
    x, y, scale = H_image_world @ corners
    # Relative to the linear part: the translation may be a million metres and says nothing about rank.
    x0 = H_image_world[:2, :2] - np.outer(H_image_world[:2, 2], H_image_world[2, :2]) / (H_image_world[2, 2] or 1.0)
    if abs(np.linalg.det(x0)) < 1e-12 or H_image_world[2, 2] == 0:
        raise UserError("H_image_world is singular; give a homography that can be inverted.")
    if scale.min() * scale.max() <= 0:
        raise UserError("the window reaches the horizon; tilt it less or make it smaller.")
    if max(np.abs(x / scale).max(), np.abs(y / scale).max()) > LIMIT_M:
        raise UserError(f"the window lies beyond {LIMIT_M:.0e} m from the origin, where positions lose precision.")
