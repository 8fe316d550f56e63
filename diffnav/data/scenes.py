"""The embedded world: an endless, seeded landscape seen from above, rendered at any scale and heading.

Tests, the demo and some training draw their "photographs", maps and exact homographies from it; nothing is
downloaded. The colour of a place depends on the seed, the place and the size of a pixel there alone, so two
windows over one place agree, whatever was rendered before. World frame: metres, x east, y north. Image frame:
pixels, x right, y down, integer coordinates at pixel centres.
"""

import math
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from diffnav.data.scenery.paint import colours
from diffnav.data.scenery.view import Size, checked_size, checked_view, ground_points, window_homography
from diffnav.errors import UserError
from diffnav.geometry.views import view_homography

__all__ = ["ScenePair", "SceneWindows", "Window", "World", "homography_pair", "window_homography"]

# Pixels painted at once: the working arrays then stay below about 100 MB, whatever the window.
CHUNK = 40_000
Range = tuple[float, float]


@dataclass(frozen=True)
class World:
    """An endless landscape; equal seeds give equal worlds, other seeds other fields, roads and houses."""

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

    def render_homography(self, H_image_world: Tensor | NDArray, size: Size) -> Tensor:
        """(3, h, w) float32 RGB in [0, 1]: the world plane through any homography, pixels to metres.

        Raises: UserError if H_image_world is singular, the window reaches the horizon, or its size is below
        1 x 1.
        """
        h, w = checked_size(size)
        H = checked_view(H_image_world, h, w)
        image = np.empty((3, h * w), np.float32)
        for start in range(0, h * w, CHUNK):
            pixel = np.arange(start, min(start + CHUNK, h * w))
            image[:, start : start + CHUNK] = colours(self.seed, *ground_points(H, pixel % w, pixel // w))
        return torch.from_numpy(image.reshape(3, h, w))


@dataclass(frozen=True)
class Window:
    """One straight-down view: everything needed to render it again."""

    name: str
    world: World
    centre_m: tuple[float, float]
    ground_sample_distance_m: float
    heading_deg: float
    size: Size

    @property
    def H_image_world(self) -> Tensor:
        """(3, 3) float64, pixels to metres."""
        return window_homography(self.centre_m, self.ground_sample_distance_m, self.heading_deg, self.size)

    def render(self) -> Tensor:
        """(3, h, w) float32 RGB in [0, 1]."""
        return self.world.render_homography(self.H_image_world, self.size)


class SceneWindows(torch.utils.data.Dataset):
    """`count` varied windows drawn from a seed, rendered when asked for: index -> (name, (3, h, w) image).

    Place (within `extent_m` of the origin), heading and scale vary, and every window has a world of its own
    unless `world` is given. `windows` holds the records. The first windows are the same for any count.
    """

    def __init__(
        self,
        seed: int,
        count: int,
        size: Size = (400, 600),
        ground_sample_distance_m: Range = (0.1, 0.4),
        extent_m: float = 20_000.0,
        world: World | None = None,
    ) -> None:
        if count < 0:
            raise UserError(f"count must be 0 or more, got {count}.")
        generator = torch.Generator().manual_seed(seed)
        self.windows = []
        for k in range(count):
            r = torch.rand(5, generator=generator, dtype=torch.float64).tolist()
            home = World(int(r[4] * 2**31)) if world is None else world
            place = ((2 * r[0] - 1) * extent_m, (2 * r[1] - 1) * extent_m)
            distance_m = _between(ground_sample_distance_m, r[2])
            self.windows.append(
                Window(f"scene_{seed}_{k:04d}", home, place, distance_m, 360 * r[3], checked_size(size))
            )

    def __len__(self) -> int:
        return len(self.windows)

    def __getitem__(self, index: int) -> tuple[str, Tensor]:
        window = self.windows[index]
        return window.name, window.render()


@dataclass(frozen=True)
class ScenePair:
    """Two windows of one place: images (3, h, w), and exact homographies (3, 3) float64."""

    image_a: Tensor
    image_b: Tensor
    H_a_b: Tensor
    H_a_world: Tensor
    H_b_world: Tensor


def homography_pair(
    world: World,
    generator: torch.Generator,
    size: Size = (400, 600),
    ground_sample_distance_m: Range = (0.1, 0.4),
    rotation_deg: float = 180.0,
    scale: float = 1.5,
    shift: float = 0.2,
    perspective: float = 0.1,
    extent_m: float = 20_000.0,
) -> ScenePair:
    """Two views of one place and the exact homography between them, both rendered, neither resampled.

    Image a looks straight down; b is turned by up to +-rotation_deg, its pixels are 1/scale to scale times as
    large, it is moved by up to +-shift of its size and tilted: the divisor at its corners is 1 +- 2
    perspective.
    Raises: UserError if scale is below 1 or perspective not in [0, 0.5).
    """
    if scale < 1 or not 0 <= perspective < 0.5:
        raise UserError(f"need scale >= 1 and perspective in [0, 0.5), got {scale} and {perspective}.")
    h, w = checked_size(size)
    r = torch.rand(4, generator=generator, dtype=torch.float64).tolist()
    place = ((2 * r[0] - 1) * extent_m, (2 * r[1] - 1) * extent_m)
    H_a_world = window_homography(place, _between(ground_sample_distance_m, r[2]), 360 * r[3], size)
    turn, zoom, *moves = (2 * torch.rand(6, generator=generator, dtype=torch.float64) - 1).tolist()
    H_b_a = view_homography(
        (h, w),
        math.radians(rotation_deg) * turn,
        scale**zoom,
        (moves[0] * shift * w, moves[1] * shift * h),
        (moves[2] * perspective, moves[3] * perspective),
    )
    H_b_world = H_a_world @ H_b_a
    H_a_b = torch.linalg.inv(H_b_a)
    image_a, image_b = (world.render_homography(H, size) for H in (H_a_world, H_b_world))
    return ScenePair(image_a, image_b, H_a_b / H_a_b[2, 2], H_a_world, H_b_world)


def _between(limits: Range, share: float) -> float:
    """From limits[0] to limits[1] evenly in the logarithm."""
    return limits[0] * (limits[1] / limits[0]) ** share
