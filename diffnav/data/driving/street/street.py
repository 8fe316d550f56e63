"""The street as a camera sees it: sky, two rows of houses, the ground, and what stands on it."""

from functools import partial

import numpy as np
import torch
from torch import Tensor

from diffnav.data.driving.street.camera import StreetCamera
from diffnav.data.driving.street.canvas import Canvas
from diffnav.data.driving.street.cars import LENGTH_M, cars_between, draw_car
from diffnav.data.driving.street.furniture import Thing, things_between
from diffnav.data.driving.street.ground import ground
from diffnav.data.driving.street.houses import WALL_M, house_pixels, paint_houses
from diffnav.data.scenery.ground import rgb
from diffnav.data.scenery.noise import Array, salted, value_noise
from diffnav.data.scenery.paint import tone

# Farther away only houses and ground are drawn; at HAZE_M half of the light is haze.
REACH_M, HAZE_M = 70.0, 160.0
_HAZE = rgb(0.74, 0.79, 0.86)


def render(seed: int, camera: StreetCamera) -> tuple[Tensor, Tensor]:
    """What a camera above the road, between the rows of houses, sees of the street of a seed.

    Returns: (3, h, w) float32 RGB in [0, 1]; (h, w) float32 depth along z, metres, infinite for the sky.
    """
    canvas = Canvas(camera)
    _backdrop(canvas, seed)
    z = camera.position_m[2]
    things: list[Thing] = list(things_between(seed, WALL_M, z, z + REACH_M))
    things += [(car.back_m, partial(draw_car, car=car)) for car in cars_between(seed, z - LENGTH_M, z + REACH_M)]
    for _, draw in sorted(things, key=lambda thing: -thing[0]):
        draw(canvas)
    colour, near = canvas.colour, np.isfinite(canvas.depth)
    colour[:, near] += (_HAZE - colour[:, near]) * (1 - 0.5 ** (canvas.depth[near] / HAZE_M))
    image = tone(colour.reshape(3, -1)).reshape(colour.shape)
    return torch.from_numpy(image), torch.from_numpy(canvas.depth)


def _backdrop(canvas: Canvas, seed: int) -> None:
    """Sky, houses and ground; what a house hides in full is not painted."""
    free = np.ones(canvas.camera.size, bool)
    seen = []
    for row in range(4):
        pixels = house_pixels(seed, row, canvas.camera, free)
        full = pixels.cover == 1
        free[pixels.rows[full], pixels.columns[full]] = False
        seen.append(pixels)
    _sky(canvas, seed, free)
    for pixels in reversed(seen):
        paint_houses(canvas, seed, pixels)
    _ground(canvas, seed)


def _sky(canvas: Canvas, seed: int, free: Array) -> None:
    right, down = canvas.camera.rays()
    i, j = np.nonzero(free & (down <= 0)[:, None])
    # Clouds lie on a plane far above; near the horizon they would be finer than pixels.
    up = np.maximum(-down[i], 0.06)
    first, second = (value_noise(salted(seed, k), right[j] / up, 1 / up, size)[0] for k, size in ((7, 1.2), (8, 0.5)))
    cover = np.clip(0.35 + 0.8 * first + 0.4 * second, 0, 1) * np.clip(up * 4, 0, 1)
    blue = _HAZE + (rgb(0.42, 0.60, 0.85) - _HAZE) * np.clip(2.2 * up, 0, 1)
    canvas.paint(i, j, blue + (rgb(0.93, 0.94, 0.96) - blue) * cover, np.ones(i.size), np.full(i.size, np.inf))


def _ground(canvas: Canvas, seed: int) -> None:
    camera = canvas.camera
    x, y, z = camera.position_m
    right, down = camera.rays()
    rows = np.flatnonzero(down > 0)
    # A row of pixels meets the ground at one depth.
    depths = -y / down[rows]
    k, j = np.nonzero(depths[:, None] < canvas.depth[rows])
    depth = depths[k]
    foot_x, foot_z = (
        (depth / camera.focal_px).astype(np.float32),
        (-(depth**2) / y / camera.focal_px).astype(np.float32),
    )
    colour = ground(seed, x + right[j] * depth, z + depth, foot_x, foot_z)
    canvas.paint(rows[k], j, colour, np.ones(k.size), depth)
