"""The ground: soil and crops in rows, parcel edges, water. Colours are display RGB (3, N) in [0, 1]."""

import numpy as np

from diffnav.data.scenery import kinds, shapes
from diffnav.data.scenery.layout import DITCH, FENCE, HEDGE, MARGIN, PATH, TRACK, Layout
from diffnav.data.scenery.noise import Array, hash_cells, uniform

Stack = list[Array]
TRAM_M = 14.0
# Salt of the noise stack that colours the ground and bends the shores.
GROUND_NOISE = 2


def rgb(r: float, g: float, b: float) -> Array:
    """(3, 1) one colour."""
    return np.array([[r], [g], [b]], np.float32)


def ground(land: Layout, noise: Stack, tint: Stack, footprint_m: Array) -> Array:
    """(3, N) the bare parcels: base colour, patches, grain, rows, tyre tracks, beds."""
    code, member = land.parcels.code, land.parcel
    cast = np.stack([0.92 + 0.22 * uniform(code, 2) + 0.07 * (uniform(code, 3 + k) - 0.5) for k in range(3)])
    colour = (land.parcels.number("colour").T * cast)[:, member]
    patches = (noise[4] + noise[5] + noise[6] + noise[7] + noise[8]) * 0.50
    grain = 0.85 * noise[0] + noise[1] + noise[2] + 0.9 * noise[3]
    light = 1 + land.at("mottle") * patches + land.at("grain") * 0.55 * grain
    light += rows(land, noise, footprint_m)
    light += beds(land, footprint_m)
    light += 0.10 * (noise[8] + noise[9])
    colour = colour * np.maximum(light, 0.15)
    # Moist and dry patches differ in hue, too.
    hue = land.at("mottle") * (0.06 * (tint[5] + tint[6] + tint[7]) + 0.05 * (tint[1] + tint[2]))
    return colour + np.stack([hue, 0.25 * hue, -0.7 * hue])


def rows(land: Layout, noise: Stack, footprint_m: Array) -> Array:
    """(N,) relative brightness of rows and tyre tracks, which turn along the edge at the field's end."""
    code, member = land.parcels.code, land.parcel
    turned = uniform(code, 6) < 0.3
    ends = land.parcels.half_u[member] - np.abs(land.u) < 5.0
    across = np.where(turned[member] ^ ends, land.u, land.v)
    wobble = across + 0.35 * (noise[5] + noise[6]) + 0.05 * noise[3]
    length = (land.parcels.number("row_m") * (0.8 + 0.4 * uniform(code, 7)))[member]
    strength = land.at("rows") * (1 + 0.8 * noise[4] + 0.6 * noise[6])
    light = strength * shapes.wave(wobble, length, footprint_m)
    offset = np.abs(shapes.repeated(wobble, TRAM_M))
    tram = shapes.stripe(offset - 0.9, 0.22, footprint_m)
    return light - land.at("tram") * tram * (1 + 0.8 * noise[4])


def beds(land: Layout, footprint_m: Array) -> Array:
    """(N,) relative brightness of small beds of 3 x 7 m, each of its own tone."""
    strength = land.at("beds")
    if not strength.any():
        return strength
    bu, bv = np.floor(land.u / 7.0).astype(np.int64), np.floor(land.v / 3.0).astype(np.int64)
    tone = uniform(hash_cells(31, land.parcels.code[land.parcel], bu, bv)) - 0.5
    gap = shapes.stripe(shapes.repeated(land.v, 3.0), 0.2, footprint_m)
    return strength * np.clip(1.5 - 0.3 * footprint_m, 0, 1) * (1.6 * tone * (1 - gap) - 0.3 * gap)


def pitches(colour: Array, land: Layout, footprint_m: Array) -> Array:
    """(3, N) with the white lines of football pitches, 62 x 40 m."""
    on = (land.parcels.kind == kinds.index(kinds.PITCH))[land.parcel]
    if not on.any():
        return colour
    u, v = np.abs(land.u), np.abs(land.v)
    lines = [
        shapes.box_distance(u, v, 31.0, 20.0),
        shapes.box_distance(u - 26.0, v, 5.0, 10.0),
        np.hypot(u, v) - 7.0,
        np.where(v < 20.0, u, 1e3),
    ]
    chalk = np.max([shapes.stripe(line, 0.07, footprint_m) for line in lines], axis=0)
    return shapes.blend(colour, rgb(0.88, 0.90, 0.86), 0.85 * on * chalk)


def edges(colour: Array, land: Layout, noise: Stack, footprint_m: Array) -> Array:
    """(3, N) with what runs along the parcels' edges painted over."""
    rough = 1 + 0.25 * (noise[1] + noise[2] + noise[3])
    for edge, offset in ((land.side_edge, land.side_edge_m), (land.strip_edge, land.strip_edge_m)):
        wild = offset + 0.35 * (noise[3] + noise[4])
        for kind, half, tone in (
            (MARGIN, 0.45, rgb(0.36, 0.39, 0.24)),
            (HEDGE, 1.3, rgb(0.24, 0.30, 0.17)),
            (DITCH, 1.2, rgb(0.33, 0.38, 0.21)),
        ):
            colour = shapes.blend(colour, tone * rough, (edge == kind) * shapes.stripe(wild, half, footprint_m))
        wet = (edge == DITCH) * shapes.stripe(wild, 0.35, footprint_m)
        colour = shapes.blend(colour, rgb(0.17, 0.20, 0.18), wet)
        colour = track(colour, edge == TRACK, wild, noise, footprint_m)
        gravel = rgb(0.58, 0.54, 0.46) * (1 + 0.18 * (noise[0] + noise[1] + noise[2]))
        path = (edge == PATH) * shapes.stripe(offset + 0.15 * noise[3], 1.0, footprint_m)
        colour = shapes.blend(colour, gravel, path)
        rail = (edge == FENCE) * shapes.stripe(offset, 0.10, footprint_m)
        colour = shapes.blend(colour, rgb(0.62, 0.58, 0.52), 0.8 * rail)
        shade = (edge == FENCE) * shapes.stripe(offset + 0.35, 0.25, footprint_m)
        colour = colour * (1 - 0.45 * shade)
    return colour


def track(colour: Array, on: Array, offset: Array, noise: Stack, footprint_m: Array) -> Array:
    """(3, N) with a farm track where `on`: two worn ruts and grass between them."""
    dirt = rgb(0.57, 0.51, 0.42) * (1 + 0.20 * (noise[1] + noise[2] + noise[4]))
    verge = rgb(0.39, 0.42, 0.26) * (1 + 0.30 * (noise[1] + noise[2]))
    colour = shapes.blend(colour, verge, on * shapes.stripe(offset, 1.9, footprint_m))
    ruts = shapes.stripe(np.abs(offset) - 0.85, 0.42, footprint_m)
    return shapes.blend(colour, dirt, on * ruts * np.clip(0.9 + 0.5 * noise[5], 0, 1))


def water_m(land: Layout, noise: Stack) -> Array:
    """(N,) signed distance to water, negative in it: the river and the ponds."""
    parcels, member = land.parcels, land.parcel
    is_pond = parcels.kind == kinds.index(kinds.POND)
    radius_u = np.minimum(0.62 * parcels.half_u, 19.0)[member]
    radius_v = np.minimum(0.55 * parcels.half_v, 14.0)[member]
    ratio = np.sqrt((land.u / radius_u) ** 2 + (land.v / radius_v) ** 2 + 1e-6)
    bays = 2.2 * (noise[6] + 0.6 * noise[5] + 0.25 * noise[4])
    pond = np.where(is_pond[member], (ratio - 1) * np.minimum(radius_u, radius_v) + bays, 1e3)
    return np.minimum(pond, land.districts.river_m + 0.4 * bays)


def water(colour: Array, distance_m: Array, x: Array, y: Array, noise: Stack, footprint_m: Array) -> Array:
    """(3, N) with wet banks and water: dark in the deep, green at the shore, rippled, with scum."""
    if distance_m.min() > 4 + footprint_m.max():
        return colour
    bank = np.clip(1 - distance_m / 4.0, 0, 1) * 0.55
    colour = shapes.blend(colour, rgb(0.36, 0.35, 0.24) * (1 + 0.35 * (noise[1] + noise[2] + noise[3])), bank)
    depth = np.clip(-distance_m / 7.0, 0, 1)
    tone = rgb(0.33, 0.37, 0.27) + (rgb(0.16, 0.23, 0.24) - rgb(0.33, 0.37, 0.27)) * depth
    ripple = shapes.wave((0.8 * x + 0.6 * y + 0.8 * noise[4]).astype(np.float32), 1.7, footprint_m)
    tone = tone * (1 + 0.06 * ripple + 0.14 * (noise[1] + noise[2]) + 0.16 * (noise[5] + noise[7]))
    scum = np.clip(3.0 * (noise[3] + noise[6] + noise[2]) - 2.0 - 1.5 * depth, 0, 1) * 0.7
    tone = shapes.blend(tone, rgb(0.45, 0.50, 0.30) * (1 + 0.2 * noise[1]), scum)
    return shapes.blend(colour, tone, shapes.inside(distance_m, footprint_m))
