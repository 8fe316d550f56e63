"""Buildings on the parcels: where they stand, the shadow they cast, their roofs.

A roof is seen from straight above, so a building is its roof: two sides of a gable in different light, or a flat
roof with a parapet and machines.
"""

from dataclasses import dataclass

import numpy as np

from diffnav.data.scenery import shapes
from diffnav.data.scenery.districts import districts
from diffnav.data.scenery.ground import Stack, rgb
from diffnav.data.scenery.layout import Layout, Parcels
from diffnav.data.scenery.noise import Array, uniform

# Where a shadow falls for each metre of height (east, north): the sun stands south-west, 52 degrees high.
SHADOW_PER_M = (0.46, 0.63)
SLOTS = 3
CLAY, SLATE, CONCRETE, METAL = [0.60, 0.33, 0.24], [0.30, 0.31, 0.34], [0.55, 0.52, 0.48], [0.68, 0.70, 0.72]
ROOF_COLOURS = np.array(
    [CLAY, CLAY, [0.52, 0.30, 0.24], SLATE, [0.41, 0.34, 0.31], CONCRETE, METAL, [0.66, 0.42, 0.30]], np.float32
)
FLAT_COLOURS = np.array([[0.90, 0.90, 0.88], [0.58, 0.57, 0.55], [0.44, 0.44, 0.45], [0.76, 0.76, 0.75]], np.float32)


@dataclass(frozen=True)
class Buildings:
    """Up to SLOTS buildings on each of M parcels, fields (M, SLOTS).

    stands: whether there is one. u, v: its centre in its parcel, metres. half_p, half_q: half sides, the first along
    the ridge. turn: radians from the parcel's u axis to the ridge. height: metres. flat: the roof is. code: hash.
    """

    stands: Array
    u: Array
    v: Array
    half_p: Array
    half_q: Array
    turn: Array
    height: Array
    flat: Array
    code: Array


def _draws(parcels: Parcels) -> Array:
    """(12, M, SLOTS) uniform numbers."""
    return np.stack([np.stack([uniform(parcels.code, 100 + 20 * s + k) for s in range(SLOTS)], 1) for k in range(12)])


def buildings(world: int, parcels: Parcels) -> Buildings:
    """The buildings of M parcels; those that a border, road or river would cut are not built."""
    r = _draws(parcels)
    plan = parcels.number("buildings")[:, None]
    hu, hv = parcels.half_u[:, None], parcels.half_v[:, None]
    slot = np.arange(SLOTS)[None]
    side = np.where(r[0] < 0.5, -1, 1)
    shed, hall = slot == 1, slot == 0
    half_p = np.select([plan == 1, plan == 2], [np.where(shed, 2.0 + r[1], 5.0 + 2.3 * r[1]), 6.0 + 5.0 * r[1]], 0)
    half_q = np.select([plan == 1, plan == 2], [np.where(shed, 1.5 + r[2], 3.8 + 1.2 * r[2]), 4.2 + 1.8 * r[2]], 0)
    half_p = np.where(plan == 3, hu * np.where(hall, 0.48 + 0.2 * r[1], 0.16), half_p)
    half_q = np.where(plan == 3, hv * np.where(hall, 0.36 + 0.2 * r[2], 0.10), half_q)
    u = np.select(
        [plan == 1, plan == 2], [np.where(shed, side * 7.0, 3 * (r[3] - 0.5)), (slot - 1) * 0.52 * hu], 6 * (r[3] - 0.5)
    )
    v = np.select(
        [plan == 1, plan == 2],
        [np.where(shed, np.where(r[6] < 0.5, -8, 8), 2 * (r[4] - 0.5)), np.where(slot == 1, 0.42, -0.35) * hv],
        np.where(hall, -0.12, 0.68) * hv,
    )
    turn = np.where(r[5] < np.where(plan == 2, 0.4, 0.25), np.float32(np.pi / 2), 0) + 0.06 * (r[7] - 0.5)
    height = np.select([plan == 1, plan == 2], [np.where(shed, 2.4, 4.8 + 1.8 * r[8]), 4.5 + 2.5 * r[8]], 7 + 2 * r[8])
    height = np.where((plan == 3) & shed, 3.5, height)
    flat = (plan == 3) | ((plan == 1) & (r[9] < 0.12))
    wanted = np.select([plan == 1, plan == 2, plan == 3], [slot < 1 + (r[10] < 0.6), slot < 3, slot < 2], False)
    stands = wanted & _clear(world, parcels, u, v, np.hypot(half_p, half_q) + height)
    code = np.stack([parcels.code + np.uint32(7919 * s) for s in range(SLOTS)], 1)
    numbers = [np.asarray(a, np.float32) for a in (u, v, half_p, half_q, turn, height)]
    return Buildings(stands, *numbers, flat, code)


def _clear(world: int, parcels: Parcels, u: Array, v: Array, reach_m: Array) -> Array:
    """(M, SLOTS) whether a building keeps within its district and away from roads and water."""
    c, s = np.cos(parcels.angle)[:, None], np.sin(parcels.angle)[:, None]
    x = (parcels.x[:, None] + (c * u - s * v)).reshape(-1)
    y = (parcels.y[:, None] + (s * u + c * v)).reshape(-1)
    d = districts(world, x, y)
    room = np.minimum(np.minimum(d.border_m, d.road_m - d.road_half_m), d.river_m).reshape(u.shape)
    return (d.code.reshape(u.shape) == parcels.district[:, None]) & (room > reach_m + 2)


@dataclass(frozen=True)
class Seen:
    """One slot's buildings at the points near them: `points` (K,) indices, (p, q) in the building's own axes."""

    points: Array
    slot: int
    parcel: Array
    p: Array
    q: Array
    half_p: Array
    half_q: Array
    shadow: tuple[Array, Array]


def seen(land: Layout, built: Buildings) -> list[Seen]:
    """The buildings near the points, slot by slot."""
    found = []
    for slot in range(SLOTS):
        k = land.parcel
        u, v = land.u - built.u[k, slot], land.v - built.v[k, slot]
        reach = built.half_p[k, slot] + built.half_q[k, slot] + built.height[k, slot]
        points = np.flatnonzero(built.stands[k, slot] & (np.abs(u) < reach) & (np.abs(v) < reach))
        if points.size == 0:
            continue
        k, u, v = k[points], u[points], v[points]
        c, s = np.cos(built.turn[k, slot]), np.sin(built.turn[k, slot])
        angle = land.parcels.angle[k] + built.turn[k, slot]
        east, north = (np.float32(a) * built.height[k, slot] for a in SHADOW_PER_M)
        shadow = (np.cos(angle) * east + np.sin(angle) * north, np.cos(angle) * north - np.sin(angle) * east)
        halves = built.half_p[k, slot], built.half_q[k, slot]
        found.append(Seen(points, slot, k, c * u + s * v, c * v - s * u, *halves, shadow))
    return found


def roof_distance(land: Layout, built: Buildings) -> Array:
    """(N,) distance to the nearest roof of the point's own parcel, negative under it."""
    distance = np.full(land.u.shape, 1e3, np.float32)
    for b in seen(land, built):
        distance[b.points] = np.minimum(distance[b.points], shapes.box_distance(b.p, b.q, b.half_p, b.half_q))
    return distance


def shadows(land: Layout, near: list[Seen], footprint_m: Array) -> Array:
    """(N,) coverage by the buildings' shadows: each the hexagon that its rectangle sweeps along the shadow."""
    cover = np.zeros(land.u.shape, np.float32)
    for b in near:
        sp, sq = b.shadow
        length = np.hypot(sp, sq)
        along_p = np.abs(b.p - 0.5 * sp) - (b.half_p + 0.5 * np.abs(sp))
        along_q = np.abs(b.q - 0.5 * sq) - (b.half_q + 0.5 * np.abs(sq))
        support = (b.half_p * np.abs(sq) + b.half_q * np.abs(sp)) / length
        across = np.abs(b.p * sq - b.q * sp) / length - support
        distance = np.maximum(np.maximum(along_p, along_q), across)
        cover[b.points] = np.maximum(cover[b.points], shapes.inside(distance, footprint_m[b.points]))
    return cover


def roofs(colour: Array, land: Layout, built: Buildings, near: list[Seen], noise: Stack, footprint_m: Array) -> Array:
    """(3, N) with the roofs painted over."""
    colour = colour.copy()
    for b in near:
        fp = footprint_m[b.points]
        grain = [noise[k][b.points] for k in range(7)]
        code = built.code[b.parcel, b.slot]
        flat = built.flat[b.parcel, b.slot]
        roof = np.where(flat, _flat(b, code, grain, fp), _gable(b, code, grain, fp))
        cover = shapes.box(b.p, b.q, b.half_p, b.half_q, fp)
        colour[:, b.points] = shapes.blend(colour[:, b.points], roof, cover)
    return colour


def _gable(b: Seen, code: Array, noise: Stack, footprint_m: Array) -> Array:
    """(3, K) a pitched roof: a lit and a shaded side, courses of tiles, ridge, chimney, perhaps solar panels."""
    tone = ROOF_COLOURS[(uniform(code, 1) * len(ROOF_COLOURS)).astype(np.int64)].T * (0.8 + 0.4 * uniform(code, 2))
    # The side that faces the sun looks away from the shadow; pitched roofs differ by about 35 percent.
    facing = -np.sign(b.q) * b.shadow[1] / np.hypot(*b.shadow)
    light = 1 + 0.26 * facing + 0.10 * (noise[0] + noise[1] + noise[2]) + 0.12 * (noise[4] + noise[5])
    light = light + 0.09 * shapes.wave(b.q, 0.55, footprint_m) + 0.05 * shapes.wave(b.p, 0.8, footprint_m)
    light = light - 0.22 * shapes.stripe(np.abs(b.q) - b.half_q, 0.15, footprint_m)
    roof = tone * light
    roof = shapes.blend(roof, tone * 1.35 + 0.03, 0.7 * shapes.stripe(b.q, 0.14, footprint_m))
    sunny = b.q * b.shadow[1] < 0
    panel_p, panel_q = b.p - 0.2 * b.half_p, np.abs(b.q) - 0.5 * b.half_q
    panel = shapes.box(panel_p, panel_q, 0.42 * b.half_p, 0.32 * b.half_q, footprint_m) * sunny
    joint = shapes.stripe(shapes.repeated(panel_p, 1.0), 0.05, footprint_m)
    roof = shapes.blend(roof, rgb(0.11, 0.14, 0.22) + 0.5 * joint, panel * (uniform(code, 3) < 0.22))
    cp, cq = b.p - (uniform(code, 4) - 0.5) * b.half_p, b.q - 0.35 * b.half_q
    sp, sq = (1.3 * a / np.hypot(*b.shadow) for a in b.shadow)
    roof = roof * (1 - 0.5 * shapes.box(cp - 0.5 * sp, cq - 0.5 * sq, 0.55, 0.5, footprint_m))
    return shapes.blend(roof, rgb(0.62, 0.50, 0.44), shapes.box(cp, cq, 0.42, 0.38, footprint_m))


def _flat(b: Seen, code: Array, noise: Stack, footprint_m: Array) -> Array:
    """(3, K) a flat roof: membrane or gravel, seams, stains, parapet, skylights and machines with shadows."""
    tone = FLAT_COLOURS[(uniform(code, 1) * len(FLAT_COLOURS)).astype(np.int64)].T
    light = 1 + 0.05 * (noise[0] + noise[1] + noise[2]) + 0.10 * (noise[4] + noise[5] + noise[6])
    light = light - 0.10 * shapes.stripe(shapes.repeated(b.p, 3.0), 0.06, footprint_m)
    rim = np.minimum(b.half_p - np.abs(b.p), b.half_q - np.abs(b.q))
    light = light + np.where(rim < 0.35, 0.16, np.where((rim < 1.0) & (b.p * b.shadow[0] < 0), -0.30, 0.0))
    roof = tone * light
    i, j = np.floor(b.p / 5.5 + 0.5).astype(np.int64), np.floor(b.q / 5.0 + 0.5).astype(np.int64)
    from_p, from_q = b.p - i * 5.5, b.q - j * 5.0
    machine = uniform((code + i * 7919 + j * 104729).astype(np.uint32), 5)
    half = 0.5 + 0.7 * np.modf(machine * 97)[0]
    sp, sq = (0.9 * a / np.hypot(*b.shadow) for a in b.shadow)
    there = (machine < 0.45) & (rim > 1.5)
    roof = roof * (1 - 0.55 * there * shapes.box(from_p - sp, from_q - sq, half, 0.75, footprint_m))
    top = np.where(machine < 0.15, np.float32(0.30), np.float32(0.78)) * (1 + 0.2 * (noise[1] + noise[2]))
    return shapes.blend(roof, np.stack([top, top, top * 1.02]), there * shapes.box(from_p, from_q, half, 0.75, footprint_m))
