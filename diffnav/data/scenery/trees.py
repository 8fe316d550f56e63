"""Trees and bushes: round crowns on a jittered grid, grown or not by what the land says at their trunk."""

from dataclasses import dataclass

import numpy as np

from diffnav.data.scenery import shapes
from diffnav.data.scenery.buildings import SHADOW_PER_M, buildings, roof_distance
from diffnav.data.scenery.ground import GROUND_NOISE, Stack, water_m
from diffnav.data.scenery.layout import HEDGE, built_edge_m, layout
from diffnav.data.scenery.noise import Array, hash_cells, neighbourhood, octaves, salted, uniform

LEAF_COLOURS = np.array(
    [
        [0.25, 0.34, 0.17],
        [0.21, 0.29, 0.16],
        [0.31, 0.38, 0.20],
        [0.36, 0.38, 0.20],
        [0.17, 0.24, 0.16],
        [0.28, 0.36, 0.22],
    ],
    np.float32,
)


@dataclass(frozen=True)
class Plants:
    """One size of plant, one at most in each cell of `cell_m`.

    column: of kinds.COLUMNS, with their share by kind of parcel. radius_m: least, and what may come on top.
    tall: height over radius. hedge, bank, roadside: least share there. coarse_m: pixels at which they begin
    to fade; at twice this they are gone. A crown and its shadow must stay within the 3 x 3 cells about their
    own: jitter + radius (1 + .62 tall) <= 1.5 cell_m.
    """

    column: str
    salt: int
    cell_m: float
    radius_m: tuple[float, float]
    tall: float
    hedge: float
    bank: float
    roadside: float
    coarse_m: float


TREES = Plants("trees", 50, 7.0, (2.5, 1.6), 1.5, hedge=0.20, bank=0.30, roadside=0.30, coarse_m=6.0)
BUSHES = Plants("bushes", 60, 3.2, (0.6, 0.9), 1.2, hedge=0.95, bank=0.60, roadside=0.06, coarse_m=1.5)


@dataclass(frozen=True)
class Trunks:
    """M cells: where a plant would stand (float64, metres), its radius, colour (M, 3), whether it grows."""

    x: Array
    y: Array
    radius: Array
    leaf: Array
    grows: Array


@dataclass(frozen=True)
class Crowns:
    """What plants do to N points: cover by crowns (N,), their colour (3, N), cover by shadows (N,)."""

    cover: Array
    colour: Array
    shadow: Array


def density(world: int, x: Array, y: Array, plants: Plants) -> Array:
    """(N,) share of plants that grow: none on roads, roofs and water, more in hedges and on banks."""
    land = layout(world, x, y)
    # The noise that shapes the shores, seen at one fixed scale: a trunk stands there at any scale or nowhere.
    noise, _ = octaves(salted(world, GROUND_NOISE), x, y, np.full(x.shape, 5.0, np.float32))
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


def trunks(world: int, i: Array, j: Array, plants: Plants) -> Trunks:
    """The plants of M cells."""
    code = hash_cells(salted(world, plants.salt), i, j)
    jitter = [0.66 * (uniform(code, k).astype(np.float64) - 0.5) for k in (2, 3)]
    x, y = (i + 0.5 + jitter[0]) * plants.cell_m, (j + 0.5 + jitter[1]) * plants.cell_m
    radius = plants.radius_m[0] + plants.radius_m[1] * uniform(code, 1) ** 1.5
    leaf = LEAF_COLOURS[(uniform(code, 5) * len(LEAF_COLOURS)).astype(np.int64)]
    grows = uniform(code, 4) < density(world, x, y, plants)
    return Trunks(x, y, radius, leaf * (0.8 + 0.4 * uniform(code, 6))[:, None], grows)


def crowns(world: int, x: Array, y: Array, plants: Plants, noise: Stack, footprint_m: Array) -> Crowns:
    """The plants of one size over N points (float64, metres); of overlapping crowns the highest is seen."""
    n = x.size
    top, result = np.zeros(n, np.float32), Crowns(*(np.zeros(s, np.float32) for s in ((n,), (3, n), (n,))))
    fade = np.clip(2 - footprint_m / plants.coarse_m, 0, 1)
    if not fade.any():
        return result
    i, j, table = neighbourhood(x, y, plants.cell_m)
    found = trunks(world, i, j, plants)
    # Clumps of leaves push a crown's outline in and out and mottle its top.
    ragged = 0.10 * noise[1] + 0.16 * noise[2] + 0.22 * noise[3]
    clumps = 0.42 * noise[0] + 0.50 * noise[1] + 0.55 * noise[2] + 0.30 * noise[3]
    for k in range(9):
        points = np.flatnonzero(found.grows[table[:, k]])
        cell = table[points, k]
        r, fp = found.radius[cell], footprint_m[points]
        dx, dy = (
            (x[points] - found.x[cell]).astype(np.float32),
            (y[points] - found.y[cell]).astype(np.float32),
        )
        wild = ragged[points] * np.minimum(r, 1.6)
        sx, sy = (np.float32(0.8 * plants.tall * a) * r for a in SHADOW_PER_M)
        cast = shapes.inside(np.hypot(dx - sx, dy - sy) - r + wild, fp)
        result.shadow[points] = np.maximum(result.shadow[points], cast * fade[points])
        distance = np.hypot(dx, dy)
        cover = shapes.inside(distance - r + wild, fp) * fade[points]
        dome = np.sqrt(np.maximum(1 - (distance / (r + 0.4)) ** 2, 0.0))
        height = cover * r * (plants.tall + dome)
        up = height > top[points]
        points = points[up]
        top[points] = height[up]
        result.cover[points] = np.maximum(result.cover[points], cover[up])
        # The sun's half is lighter; the rim, seen from above, lies in its own shade.
        facing = -(SHADOW_PER_M[0] * dx[up] + SHADOW_PER_M[1] * dy[up]) / (0.78 * r[up])
        light = 0.72 + 0.40 * dome[up] + 0.34 * facing + clumps[points]
        result.colour[:, points] = found.leaf[cell[up]].T * np.maximum(light, 0.25)
    return result
