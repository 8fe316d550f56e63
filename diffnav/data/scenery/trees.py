"""Trees and bushes: round crowns on a jittered grid, taken or not by what the land says at their trunk."""

from dataclasses import dataclass

import numpy as np

from diffnav.data.scenery import shapes
from diffnav.data.scenery.buildings import SHADOW_PER_M, buildings, roof_distance
from diffnav.data.scenery.ground import Stack, water_m
from diffnav.data.scenery.layout import HEDGE, built_edge_m, layout
from diffnav.data.scenery.noise import Array, hash_cells, neighbourhood, octaves, salted, uniform


@dataclass(frozen=True)
class Plants:
    """One size of plant. cell_m: one plant at most in each cell. radius_m: (least, span). tall: height over radius.

    The crown and its shadow must stay within the 3 x 3 cells about the plant's own: jitter + radius x (1 + shadow)
    up to 1.5 cells.
    """

    column: str
    salt: int
    cell_m: float
    radius_m: tuple[float, float]
    tall: float
    hedge: float
    bank: float
    roadside: float


TREES = Plants("trees", 50, 7.0, (2.3, 1.5), 1.5, hedge=0.20, bank=0.30, roadside=0.30)
BUSHES = Plants("bushes", 60, 3.2, (0.6, 0.9), 1.2, hedge=0.95, bank=0.60, roadside=0.06)
LEAF_COLOURS = np.array(
    [[0.25, 0.34, 0.17], [0.21, 0.29, 0.16], [0.31, 0.38, 0.20], [0.36, 0.38, 0.20], [0.17, 0.24, 0.16], [0.28, 0.36, 0.22]],
    np.float32,
)


def density(world: int, x: Array, y: Array, plants: Plants) -> Array:
    """(N,) share of plants that grow at each trunk: none on roads, roofs and water, more in hedges and at banks."""
    land = layout(world, x, y)
    noise, _ = octaves(salted(world, 1), x, y, np.full(x.shape, 5.0, np.float32))
    share = land.at(plants.column) * (1 + 0.8 * noise[6] + 0.8 * noise[7])
    side = (land.side_edge == HEDGE) & (np.abs(land.side_edge_m) < 1.3)
    hedge = side | ((land.strip_edge == HEDGE) & (np.abs(land.strip_edge_m) < 1.3))
    share = np.where(hedge, np.maximum(share, plants.hedge), share)
    water = water_m(land, noise)
    share = np.where(water < 4.0, np.maximum(share, plants.bank), share)
    d = land.districts
    beside = d.road_m - d.road_half_m
    avenue = (beside > 1.5) & (beside < 5.5) & (uniform(d.road_code, 6) < 0.6)
    share = np.where(avenue, np.maximum(share, plants.roadside), share)
    least = plants.radius_m[0]
    free = (built_edge_m(land) > 0.4 * least) & (water > 0.3)
    return share * (free & (roof_distance(land, buildings(world, land.parcels)) > 0.7 * least))


@dataclass(frozen=True)
class Crowns:
    """What plants do to N points: height of the highest crown (0 where none), coverage, colour (3, N), shadow."""

    cover: Array
    colour: Array
    shadow: Array


def crowns(world: int, x: Array, y: Array, plants: Plants, noise: Stack, footprint_m: Array) -> Crowns:
    """The plants of one size over N points (float64, metres)."""
    i, j, table = neighbourhood(x, y, plants.cell_m)
    code = hash_cells(salted(world, plants.salt), i, j)
    radius = plants.radius_m[0] + plants.radius_m[1] * uniform(code, 1) ** 2
    slack = plants.cell_m * 0.66
    px = (i + 0.5) * plants.cell_m + slack * (uniform(code, 2) - 0.5).astype(np.float64)
    py = (j + 0.5) * plants.cell_m + slack * (uniform(code, 3) - 0.5).astype(np.float64)
    grows = uniform(code, 4) < density(world, px, py, plants)
    leaf = LEAF_COLOURS[(uniform(code, 5) * len(LEAF_COLOURS)).astype(np.int64)] * (0.8 + 0.4 * uniform(code, 6))[:, None]
    n = x.shape
    top, shade = np.zeros(n, np.float32), np.zeros(n, np.float32)
    result = Crowns(np.zeros(n, np.float32), np.zeros((3, *n), np.float32), shade)
    # Ragged outlines: clumps of leaves push a crown's edge in and out.
    ragged = 0.16 * noise[2] + 0.22 * noise[3] + 0.10 * noise[1]
    clumps = 0.42 * noise[0] + 0.50 * noise[1] + 0.55 * noise[2] + 0.30 * noise[3]
    for k in range(9):
        cell = table[:, k]
        points = np.flatnonzero(grows[cell])
        if points.size == 0:
            continue
        cell = cell[points]
        r, fp = radius[cell], footprint_m[points]
        dx, dy = (x[points] - px[cell]).astype(np.float32), (y[points] - py[cell]).astype(np.float32)
        sx, sy = (np.float32(a * plants.tall * 0.8) * r for a in SHADOW_PER_M)
        wild = ragged[points] * np.minimum(r, 1.6)
        cast = shapes.inside(np.hypot(dx - sx, dy - sy) - r + wild, fp)
        shade[points] = np.maximum(shade[points], cast)
        distance = np.hypot(dx, dy)
        near = distance < r + 0.6 + fp
        points, cell, r, fp, dx, dy = (a[near] for a in (points, cell, r, fp, dx, dy))
        distance, wild = distance[near], wild[near]
        cover = shapes.inside(distance - r + wild, fp)
        dome = np.sqrt(np.maximum(1 - (distance / (r + 0.4)) ** 2, 0.0))
        height = cover * r * (plants.tall + dome)
        upper = height > top[points]
        points, cell, r = points[upper], cell[upper], r[upper]
        top[points] = height[upper]
        result.cover[points] = np.maximum(result.cover[points], cover[upper])
        # The sun-facing half is lighter; the rim, seen from above, is deep in its own shade.
        facing = -(SHADOW_PER_M[0] * dx[upper] + SHADOW_PER_M[1] * dy[upper]) / (0.78 * r)
        light = 0.62 + 0.38 * dome[upper] + 0.34 * facing + clumps[points]
        result.colour[:, points] = leaf[cell].T * np.maximum(light, 0.25)
    return result
