"""The fine layout: each district's own grid of parcels, their kinds, and what runs along their edges.

A parcel grid is turned by an angle of its district's; strips of parcels are `depth` deep, and within a strip
the parcels are `width` wide with jittered sides.
"""

from dataclasses import dataclass

import numpy as np

from diffnav.data.scenery import kinds
from diffnav.data.scenery.districts import (
    COMMERCE,
    FARMLAND,
    GREEN,
    SETTLEMENT,
    WOODLAND,
    Districts,
    districts,
    site,
)
from diffnav.data.scenery.noise import Array, group, hash_cells, salted, uniform

# Parcel depth and width in metres and jitter of the sides, by land use.
DEPTH_M = np.array([48.0, 27.0, 90.0, 66.0, 60.0], np.float32)
WIDTH_M = np.array([40.0, 23.0, 80.0, 74.0, 66.0], np.float32)
SPREAD = np.array([0.30, 0.0, 0.2, 0.1, 0.1], np.float32)
JITTER = np.array([0.55, 0.0, 0.4, 0.0, 0.0], np.float32)

OPEN, MARGIN, HEDGE, DITCH, TRACK, PATH, FENCE, STREET = range(8)
# Four equally likely edges between strips, and between the parcels of a strip, by land use.
STRIP_EDGES = {
    FARMLAND: (TRACK, TRACK, HEDGE, DITCH),
    SETTLEMENT: (HEDGE, FENCE, FENCE, HEDGE),
    WOODLAND: (TRACK, OPEN, OPEN, OPEN),
    GREEN: (PATH, PATH, HEDGE, OPEN),
    COMMERCE: (FENCE, FENCE, HEDGE, FENCE),
}
SIDE_EDGES = {
    FARMLAND: (MARGIN, MARGIN, MARGIN, HEDGE),
    SETTLEMENT: (FENCE, HEDGE, FENCE, MARGIN),
    WOODLAND: (OPEN, OPEN, OPEN, PATH),
    GREEN: (OPEN, PATH, HEDGE, OPEN),
    COMMERCE: (FENCE, HEDGE, FENCE, MARGIN),
}
STRIP_TABLE = np.array([STRIP_EDGES[use] for use in sorted(STRIP_EDGES)])
SIDE_TABLE = np.array([SIDE_EDGES[use] for use in sorted(SIDE_EDGES)])
WITH_STREETS = np.array([use in (SETTLEMENT, COMMERCE) for use in sorted(STRIP_EDGES)])
EDGE_HALF_M = np.array([0.0, 0.35, 1.1, 0.8, 1.6, 1.1, 0.12, 3.0], np.float32)


@dataclass(frozen=True)
class Parcels:
    """M parcels; every field is (M,).

    kind: row of kinds.COLUMNS. code: hash. x, y: world position of the centre, float64 metres. half_u,
    half_v: half sides, metres. angle: of the u axis against east, radians. district: hash of the district.
    """

    kind: Array
    code: Array
    x: Array
    y: Array
    half_u: Array
    half_v: Array
    angle: Array
    district: Array

    def number(self, column: str) -> Array:
        """(M, ...) one column of the table of kinds."""
        return kinds.COLUMNS[column][self.kind]


@dataclass(frozen=True)
class Layout:
    """The land at N points; every array is (N,).

    parcel: index into `parcels`. u, v: metres from the parcel's centre. strip_edge, side_edge: what runs
    along the nearest edge between strips and between parcels of a strip, OPEN ... STREET. strip_edge_m,
    side_edge_m: signed distance from it. strip_m: position along the strip, metres. strip_code: the strip
    edge's hash.
    """

    districts: Districts
    parcels: Parcels
    parcel: Array
    u: Array
    v: Array
    strip_edge: Array
    side_edge: Array
    strip_edge_m: Array
    side_edge_m: Array
    strip_m: Array
    strip_code: Array

    def at(self, column: str) -> Array:
        """(N, ...) one column of the table of kinds at every point."""
        return self.parcels.number(column)[self.parcel]


def jittered_sides(code: Array, row: Array, u: Array, width: Array, jitter: Array) -> tuple[Array, Array, Array]:
    """Column of the parcel at u in its strip, and its left and right side in metres."""

    def left(k: Array) -> Array:
        return (k + jitter * (uniform(hash_cells(21, code, row, k)) - 0.5)) * width

    column = np.floor(u / width).astype(np.int64)
    column = column - (u < left(column)) + (u >= left(column + 1))
    return column, left(column), left(column + 1)


def layout(world: int, x: Array, y: Array) -> Layout:
    """The land at N points (float64, metres)."""
    d = districts(world, x, y)
    use, code = d.land_use, d.code
    angle = uniform(code, 3) * np.float32(2 * np.pi)
    c, s = np.cos(angle), np.sin(angle)
    u, v = c * d.east + s * d.north, c * d.north - s * d.east
    depth = DEPTH_M[use] * (1 + SPREAD[use] * (2 * uniform(code, 4) - 1))
    width = WIDTH_M[use] * (1 + SPREAD[use] * (2 * uniform(code, 5) - 1))
    row = np.floor(v / depth).astype(np.int64)
    column, left, right = jittered_sides(code, row, u, width, JITTER[use])
    first, member = group(code, row, column)
    mid_u, mid_v = 0.5 * (left + right), (row + 0.5) * depth
    parcels = _parcels(d, use, angle, [a[first] for a in (row, column, mid_u, mid_v, right - left, depth)], first)

    edge_row = np.floor(v / depth + 0.5).astype(np.int64)
    strip_code = hash_cells(salted(world, 22), code, edge_row)
    strip_edge = STRIP_TABLE[use, (uniform(strip_code) * 4).astype(np.int64)]
    strip_edge = np.where(WITH_STREETS[use] & (edge_row % 2 == 0), STREET, strip_edge)
    to_left = u - left < right - u
    side_code = hash_cells(salted(world, 23), code, row, np.where(to_left, column, column + 1))
    side_edge = SIDE_TABLE[use, (uniform(side_code) * 4).astype(np.int64)]
    strip_edge_m = (v - edge_row * depth).astype(np.float32)
    side_edge_m = np.where(to_left, u - left, u - right).astype(np.float32)
    pu, pv = (u - mid_u).astype(np.float32), (v - mid_v).astype(np.float32)
    return Layout(d, parcels, member, pu, pv, strip_edge, side_edge, strip_edge_m, side_edge_m, u, strip_code)


def _parcels(d: Districts, use: Array, angle: Array, cells: list[Array], first: Array) -> Parcels:
    """The distinct parcels among the points, one of whose members `first` names."""
    row, column, mid_u, mid_v, width, depth = cells
    use, angle, district = use[first], angle[first], d.code[first]
    code = hash_cells(24, district, row, column)
    kind = kinds.MIXTURE_TABLE[use, (uniform(code) * 16).astype(np.int64)]
    c, s = np.cos(angle), np.sin(angle)
    site_x, site_y = site(district, d.i[first], d.j[first])
    x, y = site_x + (c * mid_u - s * mid_v), site_y + (s * mid_u + c * mid_v)
    half_u, half_v = (0.5 * width).astype(np.float32), (0.5 * depth).astype(np.float32)
    return Parcels(kind, code, x, y, half_u, half_v, angle, district)


def built_edge_m(land: Layout) -> Array:
    """(N,) distance to the surface of the nearest road, street, track or path, negative on it."""
    d = land.districts
    made = np.array([edge in (TRACK, PATH, STREET) for edge in range(8)])
    distance = d.road_m - d.road_half_m
    for edge, offset in ((land.strip_edge, land.strip_edge_m), (land.side_edge, land.side_edge_m)):
        on = np.where(made[edge], np.abs(offset) - EDGE_HALF_M[edge], 1e3)
        distance = np.minimum(distance, on)
    return distance
