"""The rows of houses along the street: their plots, and their fronts painted at points of the planes x = constant."""

from dataclasses import dataclass

import numpy as np

from diffnav.data.driving.street.texture import Array, grain, tiles
from diffnav.data.scenery import shapes
from diffnav.data.scenery.ground import rgb
from diffnav.data.scenery.noise import hash_cells, salted, uniform

PLOT_M, FLOOR_M, SHOP_M = 14.0, 3.2, 3.9
_WALLS = np.array(
    [
        [0.70, 0.62, 0.50],
        [0.62, 0.40, 0.32],
        [0.74, 0.72, 0.68],
        [0.55, 0.53, 0.50],
        [0.78, 0.70, 0.52],
        [0.52, 0.44, 0.40],
    ],
    np.float32,
)
_SIGNS = np.array(
    [
        [0.75, 0.15, 0.12],
        [0.10, 0.25, 0.55],
        [0.08, 0.40, 0.22],
        [0.90, 0.75, 0.15],
        [0.15, 0.15, 0.16],
        [0.9, 0.9, 0.88],
    ],
    np.float32,
)


@dataclass(frozen=True)
class Plots:
    """The plots at N positions along one row; every field is (N,).

    code: hash. left_m: where the plot begins along the street. width_m. height_m: of its house, 0 for a gap.
    """

    code: Array
    left_m: Array
    width_m: Array
    height_m: Array

    def at(self, index: Array) -> "Plots":
        """The plots at some of the positions."""
        return Plots(self.code[index], self.left_m[index], self.width_m[index], self.height_m[index])


def plots(seed: int, row: int, z: Array) -> Plots:
    """The plots of a row (0 left, 1 right, 2 and 3 behind them) at z (N,) metres along the street."""
    row_seed = salted(seed, 20 + row)

    def edge(k: Array) -> Array:
        return (k + 0.4 * (uniform(hash_cells(row_seed, k)) - 0.5)) * PLOT_M

    k = np.floor(z / PLOT_M).astype(np.int64)
    k = k - (z < edge(k)) + (z >= edge(k + 1))
    code = hash_cells(salted(seed, 25 + row), k)
    floors = np.floor(2 + 4.5 * uniform(code, 1)) + (2 if row > 1 else 0)
    height = SHOP_M + (floors - 1) * FLOOR_M + 0.7
    return Plots(code, edge(k), edge(k + 1) - edge(k), np.where(uniform(code, 2) < 0.1, 0.0, height))


def fronts(seed: int, plot: Plots, z: Array, up: Array, footprint_z: Array, footprint_up: Array) -> Array:
    """(3, N) RGB of the houses' fronts at z along the street and `up` above it, metres."""
    feet, code = (footprint_z, footprint_up), plot.code
    along = z - plot.left_m
    rough = grain(salted(seed, 30), z, up, np.maximum(0.5 * footprint_z, footprint_up))
    wall = _WALLS[(uniform(code, 3) * len(_WALLS)).astype(np.int64)].T * (0.85 + 0.3 * uniform(code, 4))
    bricks = tiles(code, along, up, (0.25, 0.08), feet) - 0.5
    stains = tiles(code + np.uint32(1), along + 0.5 * rough, up, (1.1, 2.3), feet) - 0.5
    colour = wall * (1 + 0.35 * rough + 0.3 * bricks * (uniform(code, 5) < 0.6) + 0.16 * stains)
    storey = up - SHOP_M
    bands = np.maximum(
        shapes.stripe(shapes.repeated(storey, FLOOR_M), 0.09, footprint_up),
        shapes.stripe(up - plot.height_m + 0.35, 0.3, footprint_up),
    )
    colour = shapes.blend(colour, wall * (1.15 + 0.2 * rough), bands * (storey > -0.5))
    colour = colour * (1 - 0.55 * shapes.stripe(np.abs(along - plot.width_m / 2) - plot.width_m / 2, 0.07, footprint_z))
    high, low = np.flatnonzero(storey > 0), np.flatnonzero(storey <= 0)
    for where, part in ((high, _windows), (low, _shops)):
        feet = footprint_z[where], footprint_up[where]
        colour[:, where] = part(colour[:, where], plot.at(where), along[where], up[where], feet, rough[where])
    return colour


def _windows(colour: Array, plot: Plots, along: Array, up: Array, feet: tuple[Array, Array], rough: Array) -> Array:
    """(3, N) with the windows of the upper storeys."""
    count = np.maximum(np.floor(plot.width_m / (2.0 + 1.2 * uniform(plot.code, 6))), 1)
    pitch = plot.width_m / count
    column = np.floor(along / pitch)
    storey = np.floor((up - SHOP_M) / FLOOR_M)
    code = hash_cells(52, plot.code, column.astype(np.int64), storey.astype(np.int64))
    u = along - (column + 0.5) * pitch
    v = up - SHOP_M - (storey + 0.52) * FLOOR_M
    half_u, half_v = pitch * (0.2 + 0.1 * uniform(plot.code, 7)), 0.75 + 0.3 * uniform(plot.code, 8)
    glazed = up < plot.height_m - 0.8
    frame = shapes.stripe(u, half_u + 0.12, feet[0]) * shapes.stripe(v, half_v + 0.12, feet[1]) * glazed
    colour = shapes.blend(colour, rgb(0.92, 0.9, 0.86) * (0.9 + 0.2 * rough), frame)
    pane = shapes.stripe(u, half_u, feet[0]) * shapes.stripe(v, half_v, feet[1]) * glazed
    curtain = uniform(code, 1) < 0.5
    tone = np.where(curtain, 0.45 + 0.4 * uniform(code, 2), 0.08 + 0.1 * uniform(code, 2))
    things = tiles(code, u, v, (0.23, 0.31), feet) - 0.5
    glass = np.stack([tone + 0.22 * things, tone + 0.22 * things, 1.08 * tone + 0.25 * things])
    colour = shapes.blend(colour, np.maximum(glass, 0.02), pane)
    bars = np.maximum(shapes.stripe(u, 0.03, feet[0]), shapes.stripe(v - 0.35 * half_v, 0.03, feet[1]))
    colour = shapes.blend(colour, rgb(0.9, 0.88, 0.84), bars * pane)
    sill = shapes.stripe(u, half_u + 0.25, feet[0]) * shapes.stripe(v + half_v + 0.14, 0.06, feet[1]) * glazed
    return shapes.blend(colour, rgb(0.8, 0.78, 0.75), sill)


def _shops(colour: Array, plot: Plots, along: Array, up: Array, feet: tuple[Array, Array], rough: Array) -> Array:
    """(3, N) with shop windows, doors, lettering above them, and posters."""
    pitch = plot.width_m / np.maximum(np.round(plot.width_m / 4.6), 1)
    column = np.floor(along / pitch)
    code = hash_cells(53, plot.code, column.astype(np.int64))
    u, half = along - (column + 0.5) * pitch, 0.5 * pitch - 0.35
    sign = _SIGNS[(uniform(code, 1) * len(_SIGNS)).astype(np.int64)].T
    board = shapes.stripe(u, half, feet[0]) * shapes.stripe(up - 3.25, 0.33, feet[1])
    letters = tiles(code, u, up - 3.05, (0.13, 0.2), feet)
    bright = np.clip((letters - 0.5) * 6 + 0.5, 0, 1) * (np.abs(up - 3.25) < 0.2) * (np.abs(u) < 0.8 * half)
    colour = shapes.blend(colour, shapes.blend(sign, 1 - 0.8 * sign, bright), board)
    glass = shapes.stripe(u + 0.5, half - 0.55, feet[0]) * shapes.stripe(up - 1.7, 1.05, feet[1])
    goods = tiles(code + np.uint32(1), u, up, (0.21, 0.27), feet)
    shelves = 1 - 0.6 * shapes.stripe(shapes.repeated(up, 0.55), 0.03, feet[1])
    shown = np.stack([0.12 + 0.6 * goods, 0.12 + 0.5 * goods**2, 0.1 + 0.5 * np.abs(goods - 0.3)]) * shelves
    colour = shapes.blend(colour, shown, glass)
    door = shapes.stripe(u - half + 0.45, 0.42, feet[0]) * shapes.stripe(up - 1.15, 1.15, feet[1])
    inset = shapes.box(shapes.repeated(u, 0.42), shapes.repeated(up, 0.9), 0.13, 0.33, feet[1])
    panel = 0.25 + 0.3 * uniform(code, 2) - 0.15 * inset
    colour = shapes.blend(colour, sign * 0.4 + rgb(0.9, 0.7, 0.5) * panel, door)
    poster = shapes.box(u + 0.3, up - 1.5 - 0.4 * uniform(code, 3), 0.4, 0.55, feet[1]) * (uniform(code, 4) < 0.5)
    ink = tiles(code + np.uint32(2), u, up, (0.09, 0.12), feet)
    return shapes.blend(colour, np.stack([ink, 1 - 0.7 * ink, 0.3 + 0.5 * ink]), poster * (0.9 + 0.2 * rough))
