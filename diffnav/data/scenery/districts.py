"""The coarse layout: districts of one land use each, the roads between them, and a river.

Districts are the Voronoi cells of jittered sites, bent a little by noise; roads run along their borders.
"""

from dataclasses import dataclass

import numpy as np

from diffnav.data.scenery.noise import Array, hash_cells, salted, uniform, uniform_pair, value_noise

DISTRICT_M = 230.0
FARMLAND, SETTLEMENT, WOODLAND, GREEN, COMMERCE = range(5)
# Cumulative shares of the land uses above.
LAND_USE_SHARES = np.array([0.42, 0.70, 0.79, 0.92, 1.01], np.float32)
ROAD_HALF_M, LANE_HALF_M, GRAVEL_HALF_M = 4.3, 2.6, 1.9
ROAD_HALVES_M = np.array([ROAD_HALF_M, ROAD_HALF_M, LANE_HALF_M, GRAVEL_HALF_M])
# Borders leave the straight by up to this much, over 170 m.
BEND_M = 9.0
RIVER_M = 700.0


@dataclass(frozen=True)
class Districts:
    """What the coarse layout says about N points; every field is (N,).

    i, j: the district's cell. code: its hash. east, north: position relative to its site, metres.
    border_m: distance to the nearest border. road_m: distance to the nearest road's axis.
    road_half_m: that road's half width. road_side_m: signed offset from its axis. road_along_m: position
    along it. road_code: its hash. junction_m: how much farther the second nearest border is than the
    nearest. river_m: distance to the river's edge, negative in the water.
    """

    i: Array
    j: Array
    code: Array
    east: Array
    north: Array
    border_m: Array
    road_m: Array
    road_half_m: Array
    road_side_m: Array
    road_along_m: Array
    road_code: Array
    junction_m: Array
    river_m: Array

    @property
    def land_use(self) -> Array:
        """(N,) one of FARMLAND ... COMMERCE."""
        return np.searchsorted(LAND_USE_SHARES, uniform(self.code, 1), side="right")


def site(code: Array, i: Array, j: Array) -> tuple[Array, Array]:
    """World position (float64, metres) of a district's site."""
    a, b = uniform_pair(code)
    return (i + 0.5 + 0.6 * (a - 0.5)) * DISTRICT_M, (j + 0.5 + 0.6 * (b - 0.5)) * DISTRICT_M


def river_distance(seed: int, x: Array, y: Array) -> Array:
    """(N,) metres to the water's edge, negative in the water: the winding zero line of a slow noise."""
    step = 4.0
    n, _ = value_noise(salted(seed, 11), x, y, RIVER_M)
    nx, _ = value_noise(salted(seed, 11), x + step, y, RIVER_M)
    ny, _ = value_noise(salted(seed, 11), x, y + step, RIVER_M)
    # The floor keeps saddles of the noise from becoming lakes that fill a window.
    slope = np.maximum(np.hypot(nx - n, ny - n) / step, 1.2 / RIVER_M)
    bend, _ = value_noise(salted(seed, 12), x, y, 23.0)
    return np.abs(n) / slope - (9.0 + 3.0 * bend)


def nearest_site(seed: int, x: Array, y: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Cell i, j, hash, and offset (float32, metres) of the point from its district's site."""
    base_i = np.floor(x / DISTRICT_M).astype(np.int64)
    base_j = np.floor(y / DISTRICT_M).astype(np.int64)
    best = np.full(x.shape, np.inf)
    i, j, code = base_i, base_j, np.zeros(x.shape, np.uint32)
    east = north = np.zeros(x.shape)
    for di in (-1, 0, 1):
        for dj in (-1, 0, 1):
            other = hash_cells(seed, base_i + di, base_j + dj)
            sx, sy = site(other, base_i + di, base_j + dj)
            distance = (x - sx) ** 2 + (y - sy) ** 2
            closer = distance < best
            best = np.where(closer, distance, best)
            i, j = np.where(closer, base_i + di, i), np.where(closer, base_j + dj, j)
            code = np.where(closer, other, code)
            east, north = np.where(closer, x - sx, east), np.where(closer, y - sy, north)
    return i, j, code, east, north


def borders(seed: int, i: Array, j: Array, code: Array, east: Array, north: Array) -> dict[str, Array]:
    """The fields of Districts about borders and roads, at (east, north) from the site of district i, j."""
    far = np.full(east.shape, 1e3)
    near, second, road, half, side, along = far, far, far, np.ones_like(far), far, np.zeros_like(far)
    road_code = np.zeros(east.shape, np.uint32)
    own_x, own_y = site(code, i, j)
    for di, dj in ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)):
        other = hash_cells(seed, i + di, j + dj)
        other_x, other_y = site(other, i + di, j + dj)
        nx, ny = other_x - own_x, other_y - own_y
        length = np.hypot(nx, ny)
        nx, ny = nx / length, ny / length
        distance = 0.5 * length - (nx * east + ny * north)
        second = np.where(distance < near, near, np.minimum(second, distance))
        near = np.minimum(near, distance)
        # Both districts must draw one road: its hash is symmetric, its direction follows the hashes.
        pair = code ^ other
        width = ROAD_HALVES_M[(uniform(pair, 2) * 4).astype(np.int64)]
        sign = np.where(code < other, 1.0, -1.0)
        closer = distance - width < road - half
        road, half = np.where(closer, distance, road), np.where(closer, width, half)
        side = np.where(closer, sign * distance, side)
        # The line between two sites meets their border at right angles: the origin along it for both.
        along = np.where(closer, sign * (nx * north - ny * east), along)
        road_code = np.where(closer, pair, road_code)
    numbers = {
        "border_m": near,
        "road_m": road,
        "road_half_m": half,
        "road_side_m": side,
        "road_along_m": along,
        "junction_m": second - near,
    }
    return {name: a.astype(np.float32) for name, a in numbers.items()} | {"road_code": road_code}


def districts(world: int, x: Array, y: Array) -> Districts:
    """The coarse layout at N points (float64, metres)."""
    seed = salted(world, 10)
    bend_x, bend_y = (BEND_M * a for a in value_noise(salted(world, 13), x, y, 170.0))
    i, j, code, east, north = nearest_site(seed, x + bend_x, y + bend_y)
    return Districts(
        i=i,
        j=j,
        code=code,
        # Bent borders, straight parcels: positions in a district are those before bending.
        east=(east - bend_x).astype(np.float32),
        north=(north - bend_y).astype(np.float32),
        river_m=river_distance(salted(world, 14), x, y).astype(np.float32),
        **borders(seed, i, j, code, east, north),
    )
