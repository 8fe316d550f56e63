"""Roads and streets with their markings, and the cars on and beside them."""

import numpy as np

from diffnav.data.scenery import kinds, shapes
from diffnav.data.scenery.districts import GRAVEL_HALF_M, LANE_HALF_M
from diffnav.data.scenery.ground import Stack, rgb
from diffnav.data.scenery.layout import STREET, Layout
from diffnav.data.scenery.noise import Array, hash_cells, uniform

WHITE = rgb(0.90, 0.90, 0.88)
CAR_COLOURS = np.array(
    [
        [0.93, 0.93, 0.92],
        [0.70, 0.72, 0.74],
        [0.12, 0.12, 0.13],
        [0.30, 0.31, 0.33],
        [0.46, 0.15, 0.13],
        [0.18, 0.24, 0.36],
        [0.90, 0.90, 0.90],
        [0.60, 0.61, 0.62],
        [0.20, 0.20, 0.21],
        [0.96, 0.96, 0.95],
        [0.45, 0.44, 0.40],
    ],
    np.float32,
)


def asphalt(noise: Stack, tone: Array | float = 0.42) -> Array:
    """(3, N) worn asphalt: speckle, patches and stains."""
    light = tone * (1 + 0.10 * (noise[0] + noise[1]) + 0.09 * (noise[2] + noise[4]) + 0.08 * (noise[5] + noise[7]))
    return np.stack([light, light * 0.995, light * 0.985])


def roads(colour: Array, land: Layout, noise: Stack, footprint_m: Array) -> Array:
    """(3, N) with streets, then the roads along district borders, painted over."""
    return main_roads(streets(colour, land, noise, footprint_m), land, noise, footprint_m)


def streets(colour: Array, land: Layout, noise: Stack, footprint_m: Array) -> Array:
    """(3, N) with residential streets: pavements, kerbs, parked cars."""
    on = land.strip_edge == STREET
    if not on.any():
        return colour
    offset, along = land.strip_edge_m, land.strip_m
    slabs = (
        1
        + 0.08 * (noise[1] + noise[2] + noise[5])
        - 0.1 * shapes.stripe(shapes.repeated(along, 2.0), 0.08, footprint_m)
    )
    colour = shapes.blend(colour, rgb(0.58, 0.56, 0.53) * slabs, on * shapes.stripe(offset, 4.4, footprint_m))
    tone = 0.36 + 0.12 * uniform(land.strip_code, 3)
    colour = shapes.blend(colour, asphalt(noise, tone), on * shapes.stripe(offset, 3.0, footprint_m))
    kerb = shapes.stripe(np.abs(offset) - 3.05, 0.10, footprint_m)
    colour = shapes.blend(colour, rgb(0.72, 0.71, 0.68), on * kerb)
    side = np.where(offset > 0, 1, -1)
    return cars(colour, on, along, np.abs(offset) - 2.0, 6.5, 0.34, hash_cells(41, land.strip_code, side), footprint_m)


def main_roads(colour: Array, land: Layout, noise: Stack, footprint_m: Array) -> Array:
    """(3, N) with the roads along district borders: verge, asphalt, lines, traffic."""
    d = land.districts
    if d.road_m.min() > 8 + footprint_m.max():
        return colour
    half, offset, along = d.road_half_m, d.road_side_m, d.road_along_m
    wide = half > LANE_HALF_M + 0.1
    verge = rgb(0.44, 0.44, 0.30) * (1 + 0.30 * (noise[1] + noise[2] + noise[4]))
    reach = half + 1.6 + 0.5 * noise[4]
    colour = shapes.blend(colour, verge, shapes.inside(d.road_m - reach, footprint_m))
    gravel = rgb(0.57, 0.54, 0.48) * (1 + 0.2 * (noise[1] + noise[2]))
    colour = shapes.blend(colour, gravel, shapes.inside(d.road_m - half - 0.4 - 0.2 * noise[3], footprint_m))
    tone = 0.34 + 0.16 * uniform(d.road_code, 4)
    lanes = 0.04 * shapes.stripe(np.abs(np.abs(offset) - 2.0) - 0.8, 0.3, np.maximum(footprint_m, 0.6))
    paved = half > GRAVEL_HALF_M + 0.1
    surface = np.where(paved, asphalt(noise, tone - lanes), gravel * (1 - 3 * lanes))
    colour = shapes.blend(colour, surface, shapes.inside(d.road_m - half, footprint_m))
    # Lines stop where roads meet.
    clear = np.clip((d.junction_m - 2.2 * half) / 1.0, 0, 1) * wide * (0.85 + 0.25 * noise[3])
    edge = shapes.stripe(np.abs(offset) - (half - 0.35), 0.08, footprint_m)
    dash = shapes.stripe(offset, 0.09, footprint_m) * shapes.stripe(shapes.repeated(along, 9.0), 2.0, footprint_m)
    colour = shapes.blend(colour, WHITE, np.clip(np.maximum(edge, dash) * clear, 0, 1))
    lane = hash_cells(42, d.road_code, np.where(offset > 0, 1, -1))
    driving = wide & (d.junction_m > 3 * half)
    return cars(colour, driving, along, np.abs(offset) - 1.9, 16.0, 0.34, lane, footprint_m)


def parking(colour: Array, land: Layout, footprint_m: Array) -> Array:
    """(3, N) with the bays of car parks and the cars in them."""
    on = (land.parcels.kind == kinds.index(kinds.PARKING))[land.parcel]
    on &= np.abs(land.v) < land.parcels.half_v[land.parcel] - 4
    on &= np.abs(land.u) < land.parcels.half_u[land.parcel] - 4
    if not on.any():
        return colour
    # Double rows of bays 5 m deep every 16 m: an aisle of 6 m between them.
    row = shapes.repeated(land.v, 16.0)
    in_bay = on & (np.abs(row) < 5.0)
    line = shapes.stripe(shapes.repeated(land.u, 2.6), 0.07, footprint_m)
    line = np.maximum(line, shapes.stripe(row, 0.07, footprint_m))
    colour = shapes.blend(colour, WHITE, in_bay * line * 0.8)
    lane = np.floor(land.v / 16.0 + 0.5).astype(np.int64)
    code = hash_cells(43, land.parcels.code[land.parcel], lane, np.where(row > 0, 1, 0))
    shifted = np.abs(row) - 2.6
    return cars(colour, in_bay, land.u + 1.3, shifted, 2.6, 0.55, code, footprint_m, turned=True)


def cars(
    colour: Array,
    on: Array,
    along: Array,
    across: Array,
    period_m: float,
    share: float,
    lane: Array,
    footprint_m: Array,
    turned: bool = False,
) -> Array:
    """(3, N) with a line of cars where `on`: one place every `period_m`, a `share` of them taken.

    along, across: position along the line and signed offset from the cars' axis, metres. lane: hash of the
    line. turned: the cars stand across the line (in bays), else along it.
    """
    place = np.floor(along / period_m)
    code = hash_cells(44, lane, place.astype(np.int64))
    slack = np.maximum(period_m - (2.1 if turned else 5.2), 0.0)
    shift = (uniform(code, 1) - 0.5) * slack
    p, q = along - (place + 0.5) * period_m - shift, across + 0.3 * (uniform(code, 2) - 0.5)
    on = on & (uniform(code, 3) < share)
    near = np.flatnonzero(on & (np.abs(p) < 4) & (np.abs(q) < 4))
    if near.size == 0:
        return colour
    p, q, code, fp = p[near], q[near], code[near], np.broadcast_to(footprint_m, on.shape)[near]
    if turned:
        p, q = q, p
    half = 2.0 + 0.35 * uniform(code, 4)
    part = colour[:, near]
    part = part * (1 - 0.55 * shapes.box(p - 0.35, q - 0.35, half, 0.95, fp))
    paint = CAR_COLOURS[(uniform(code, 5) * len(CAR_COLOURS)).astype(np.int64)].T
    part = shapes.blend(part, paint * (1 - 0.06 * (np.abs(q) > 0.7)), shapes.box(p, q, half, 0.88, fp))
    glass = np.maximum(shapes.box(p - 0.75, q, 0.38, 0.72, fp), shapes.box(p + 1.35, q, 0.28, 0.70, fp))
    part = shapes.blend(part, rgb(0.10, 0.12, 0.14), 0.9 * glass)
    colour = colour.copy()
    colour[:, near] = part
    return colour
