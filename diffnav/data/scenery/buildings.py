"""Where buildings stand on the parcels, and which of them are near a point."""

from dataclasses import dataclass

import numpy as np

from diffnav.data.scenery import shapes
from diffnav.data.scenery.districts import districts
from diffnav.data.scenery.layout import Layout, Parcels
from diffnav.data.scenery.noise import Array, uniform

# Where a shadow falls for each metre of height (east, north): the sun stands south-west, 52 degrees high.
SHADOW_PER_M = (0.46, 0.63)
SLOTS = 3
HOUSE, FARM, HALLS = 1, 2, 3


@dataclass(frozen=True)
class Buildings:
    """Up to SLOTS buildings on each of M parcels; every field is (M, SLOTS).

    stands: whether there is one. u, v: its centre in its parcel, metres. half_p, half_q: half sides, metres,
    the first along the ridge. turn: from the parcel's u axis to the ridge, radians. height: metres. flat:
    the roof is. code: hash.
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


def buildings(world: int, parcels: Parcels) -> Buildings:
    """The buildings of M parcels; those that a border, a road or the river would cut are not built."""
    r = _draws(parcels)
    plan = np.broadcast_to(parcels.number("buildings")[:, None], r[0].shape)
    slot = np.broadcast_to(np.arange(SLOTS), r[0].shape)
    plans = [plan == HOUSE, plan == FARM, plan == HALLS]
    second = slot == 1
    u, v = _centres(parcels, r, plans, slot)
    half_p, half_q = _halves(parcels, r, plans, second)
    quarter = np.where(plan == FARM, 0.4, 0.25)
    turn = np.where(r[5] < quarter, np.pi / 2, 0) + 0.06 * (r[7] - 0.5)
    heights = [np.where(second, 2.4, 4.8 + 1.8 * r[8]), 4.5 + 2.5 * r[8], np.where(second, 3.5, 7 + 2 * r[8])]
    height = np.select(plans, heights, 1.0)
    wanted = np.select(plans, [slot < 1 + (r[10] < 0.6), slot < 3, slot < 2], False)
    return Buildings(
        stands=wanted & _clear(world, parcels, u, v, np.hypot(half_p, half_q) + height),
        u=u.astype(np.float32),
        v=v.astype(np.float32),
        half_p=half_p.astype(np.float32),
        half_q=half_q.astype(np.float32),
        turn=turn.astype(np.float32),
        height=height.astype(np.float32),
        flat=(plan == HALLS) | ((plan == HOUSE) & (r[9] < 0.12)),
        code=np.stack([parcels.code + np.uint32(7919 * s) for s in range(SLOTS)], 1),
    )


def _draws(parcels: Parcels) -> Array:
    """(11, M, SLOTS) uniform numbers."""
    numbers = [[uniform(parcels.code, 100 + 20 * s + k) for s in range(SLOTS)] for k in range(11)]
    return np.moveaxis(np.array(numbers), 1, 2)


def _centres(parcels: Parcels, r: Array, plans: list[Array], slot: Array) -> tuple[Array, Array]:
    """u, v (M, SLOTS): a house in the middle, a shed in a corner; barns about a yard; halls in two rows."""
    half_u, half_v = parcels.half_u[:, None], parcels.half_v[:, None]
    second = slot == 1
    side, end = np.where(r[0] < 0.5, -1, 1), np.where(r[6] < 0.5, -1, 1)
    house = np.where(second, side * 8.2, 3 * (r[3] - 0.5)), np.where(second, end * 6.2, 2 * (r[4] - 0.5))
    farm = (slot - 1) * 0.52 * half_u, np.where(second, 0.42, -0.35) * half_v
    halls = 6 * (r[3] - 0.5), np.where(second, 0.68, -0.12) * half_v
    u, v = (np.select(plans, choices, 0.0) for choices in zip(house, farm, halls, strict=True))
    return u, v


def _halves(parcels: Parcels, r: Array, plans: list[Array], second: Array) -> tuple[Array, Array]:
    """half_p, half_q (M, SLOTS), metres."""
    half_u, half_v = parcels.half_u[:, None], parcels.half_v[:, None]
    house = (
        np.where(second, 1.6 + 0.7 * r[1], 5.0 + 2.3 * r[1]),
        np.where(second, 1.2 + 0.6 * r[2], 3.8 + 1.2 * r[2]),
    )
    farm = 6.0 + 5.0 * r[1], 4.2 + 1.8 * r[2]
    halls = (
        half_u * np.where(second, 0.16, 0.48 + 0.2 * r[1]),
        half_v * np.where(second, 0.10, 0.36 + 0.2 * r[2]),
    )
    half_p, half_q = (np.select(plans, choices, 1.0) for choices in zip(house, farm, halls, strict=True))
    return half_p, half_q


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
    """The buildings of one slot at the K points near them; every field but `points` is about these points.

    points: (K,) indices. code: hash of the building. p, q: position in its own axes, p along the ridge,
    metres. half_p, half_q: its half sides. shadow: (p, q) where its top's shadow falls, metres. flat: its
    roof is.
    """

    points: Array
    code: Array
    p: Array
    q: Array
    half_p: Array
    half_q: Array
    shadow: tuple[Array, Array]
    flat: Array


def seen(land: Layout, built: Buildings) -> list[Seen]:
    """The buildings near the points of `land`, slot by slot; a point knows those of its own parcel."""
    found = []
    for slot in range(SLOTS):
        k = land.parcel
        u, v = land.u - built.u[k, slot], land.v - built.v[k, slot]
        reach = (built.half_p + built.half_q + built.height)[k, slot]
        points = np.flatnonzero(built.stands[k, slot] & (np.abs(u) < reach) & (np.abs(v) < reach))
        if points.size == 0:
            continue
        k, u, v = k[points], u[points], v[points]
        turn, height = built.turn[k, slot], built.height[k, slot]
        c, s = np.cos(turn), np.sin(turn)
        angle = land.parcels.angle[k] + turn
        east, north = (np.float32(a) * height for a in SHADOW_PER_M)
        shadow = (np.cos(angle) * east + np.sin(angle) * north, np.cos(angle) * north - np.sin(angle) * east)
        half_p, half_q = built.half_p[k, slot], built.half_q[k, slot]
        code, flat = built.code[k, slot], built.flat[k, slot]
        found.append(Seen(points, code, c * u + s * v, c * v - s * u, half_p, half_q, shadow, flat))
    return found


def roof_distance(land: Layout, built: Buildings) -> Array:
    """(N,) distance to the nearest roof of the point's own parcel, negative under it, metres."""
    distance = np.full(land.u.shape, 1e3, np.float32)
    for b in seen(land, built):
        distance[b.points] = np.minimum(distance[b.points], shapes.box_distance(b.p, b.q, b.half_p, b.half_q))
    return distance
