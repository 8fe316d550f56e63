"""Which pixels see a row of houses: the planes x = constant, cut off at the roofs."""

from dataclasses import dataclass

import numpy as np

from diffnav.data.driving.street.buildings import Plots, fronts, plots
from diffnav.data.driving.street.camera import Array, StreetCamera
from diffnav.data.driving.street.canvas import Canvas
from diffnav.data.scenery.noise import salted

WALL_M, BACK_WALL_M = 9.0, 24.0
# The sun stands on the left: the right row is bright.
_LIGHT = (0.72, 1.0)


@dataclass(frozen=True)
class HousePixels:
    """The N pixels that see one row of houses; every array is (N,).

    row: 0 left and 1 right of the street, 2 and 3 behind them. rows, columns: the pixels. plot, along, up: what each
    sees, plot and metres along the street and above it. cover: in [0, 1], less than 1 at the roof's edge.
    footprints_m: along the street and up. depth_m: along z.
    """

    row: int
    rows: Array
    columns: Array
    plot: Plots
    along: Array
    up: Array
    cover: Array
    footprints_m: tuple[Array, Array]
    depth_m: Array


def house_pixels(seed: int, row: int, camera: StreetCamera, free: Array) -> HousePixels:
    """The pixels that see a row of houses, among those where `free` (h, w) says that nothing stands before them."""
    x, y, z = camera.position_m
    right, down = camera.rays()
    aside = (-1 if row % 2 == 0 else 1) * (WALL_M if row < 2 else BACK_WALL_M) - x
    # A column of pixels meets the plane at one depth.
    columns = np.flatnonzero(right * aside > 0)
    depths = aside / right[columns]
    houses = plots(seed, row, z + depths)
    foot_along, foot_up = depths**2 / abs(aside) / camera.focal_px, depths / camera.focal_px
    up = -(y + down[:, None] * depths)
    cover = np.clip(0.5 - (up - houses.height_m) / foot_up, 0, 1)
    i, k = np.nonzero((up > 0) & (cover > 0) & (houses.height_m > 0) & free[:, columns])
    footprints = foot_along[k].astype(np.float32), foot_up[k].astype(np.float32)
    return HousePixels(row, i, columns[k], houses.at(k), z + depths[k], up[i, k], cover[i, k], footprints, depths[k])


def paint_houses(canvas: Canvas, seed: int, seen: HousePixels) -> None:
    """Paint the fronts of one row over what lies behind them."""
    colour = fronts(salted(seed, seen.row), seen.plot, seen.along, seen.up, *seen.footprints_m)
    canvas.paint(seen.rows, seen.columns, colour * np.float32(_LIGHT[seen.row % 2]), seen.cover, seen.depth_m)
