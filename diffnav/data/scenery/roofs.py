"""Roofs, the shadows of buildings, and the paving around them.

Seen from straight above a building is its roof: two sides of a gable in different light, or a flat roof with
a parapet and machines.
"""

import numpy as np

from diffnav.data.scenery import shapes
from diffnav.data.scenery.buildings import Seen
from diffnav.data.scenery.ground import Stack, rgb
from diffnav.data.scenery.noise import Array, hash_cells, uniform

CLAY, SLATE, CONCRETE, METAL = [0.56, 0.35, 0.28], [0.30, 0.31, 0.34], [0.55, 0.52, 0.48], [0.68, 0.70, 0.72]
ROOF_COLOURS = np.array(
    [CLAY, CLAY, [0.48, 0.31, 0.27], SLATE, [0.41, 0.34, 0.31], CONCRETE, METAL, [0.62, 0.44, 0.35]],
    np.float32,
)
FLAT_COLOURS = np.array([[0.90, 0.90, 0.88], [0.58, 0.57, 0.55], [0.44, 0.44, 0.45], [0.76, 0.76, 0.75]], np.float32)


def terraces(colour: Array, near: list[Seen], noise: Stack, footprint_m: Array) -> Array:
    """(3, N) with the paving around buildings: a terrace on one side and a drive off one corner."""
    colour = colour.copy()
    for b in near:
        fp, k = footprint_m[b.points], b.points
        slabs = rgb(0.56, 0.53, 0.48) * (1 + 0.13 * (noise[0][k] + noise[1][k] + noise[2][k] + noise[5][k]))
        slabs = slabs * (1 - 0.10 * shapes.stripe(shapes.repeated(b.p, 1.0), 0.05, fp))
        terrace = shapes.box(b.p - 1.2, b.q + 0.5, b.half_p + 0.4, b.half_q + 2.0, fp)
        drive = shapes.box(b.p - b.half_p + 1.5, b.q - b.half_q - 3.0, 1.5, 4.0, fp)
        colour[:, k] = shapes.blend(colour[:, k], slabs, np.maximum(terrace, drive))
    return colour


def shadows(near: list[Seen], footprint_m: Array) -> Array:
    """(N,) coverage by shadows of buildings: each is the hexagon that a rectangle sweeps along the shadow."""
    cover = np.zeros(footprint_m.shape, np.float32)
    for b in near:
        sp, sq = b.shadow
        along_p = np.abs(b.p - 0.5 * sp) - (b.half_p + 0.5 * np.abs(sp))
        along_q = np.abs(b.q - 0.5 * sq) - (b.half_q + 0.5 * np.abs(sq))
        beside = np.abs(b.p * sq - b.q * sp) - (b.half_p * np.abs(sq) + b.half_q * np.abs(sp))
        distance = np.maximum(np.maximum(along_p, along_q), beside / np.hypot(sp, sq))
        cover[b.points] = np.maximum(cover[b.points], shapes.inside(distance, footprint_m[b.points]))
    return cover


def roofs(colour: Array, near: list[Seen], noise: Stack, footprint_m: Array) -> Array:
    """(3, N) with the roofs painted over."""
    colour = colour.copy()
    for b in near:
        fp = footprint_m[b.points]
        grain = [octave[b.points] for octave in noise[:7]]
        roof = np.where(b.flat, _flat(b, grain, fp), _gable(b, grain, fp))
        cover = shapes.box(b.p, b.q, b.half_p, b.half_q, fp)
        colour[:, b.points] = shapes.blend(colour[:, b.points], roof, cover)
    return colour


def _palette(colours: Array, code: Array) -> Array:
    """(3, K) each building's colour out of (C, 3)."""
    return colours[(uniform(code, 1) * len(colours)).astype(np.int64)].T


def _gable(b: Seen, noise: Stack, footprint_m: Array) -> Array:
    """(3, K) a pitched roof: lit and shaded side, courses of tiles, ridge, chimney, perhaps solar panels."""
    tone = _palette(ROOF_COLOURS, b.code) * (0.8 + 0.4 * uniform(b.code, 2))
    unit_p, unit_q = (a / np.hypot(*b.shadow) for a in b.shadow)
    # The side that faces the sun looks away from where the shadow falls.
    light = 1 - 0.26 * np.clip(b.q / (0.5 * footprint_m), -1, 1) * unit_q
    light = light + 0.10 * (noise[0] + noise[1] + noise[2]) + 0.12 * (noise[4] + noise[5])
    light = light + 0.09 * shapes.wave(b.q, 0.55, footprint_m) + 0.05 * shapes.wave(b.p, 0.8, footprint_m)
    light = light - 0.22 * shapes.stripe(np.abs(b.q) - b.half_q, 0.15, footprint_m)
    roof = shapes.blend(tone * light, tone * 1.35 + 0.03, 0.7 * shapes.stripe(b.q, 0.14, footprint_m))
    panel_p, panel_q = b.p - 0.2 * b.half_p, np.abs(b.q) - 0.5 * b.half_q
    panel = shapes.box(panel_p, panel_q, 0.42 * b.half_p, 0.32 * b.half_q, footprint_m)
    panel = panel * (b.q * unit_q < 0) * (uniform(b.code, 3) < 0.22)
    joint = shapes.stripe(shapes.repeated(panel_p, 1.0), 0.05, footprint_m)
    roof = shapes.blend(roof, rgb(0.11, 0.14, 0.22) + 0.5 * joint, panel)
    chimney_p, chimney_q = b.p - (uniform(b.code, 4) - 0.5) * b.half_p, b.q - 0.35 * b.half_q
    cast = shapes.box(chimney_p - 0.65 * unit_p, chimney_q - 0.65 * unit_q, 0.55, 0.5, footprint_m)
    chimney = shapes.box(chimney_p, chimney_q, 0.42, 0.38, footprint_m)
    return shapes.blend(roof * (1 - 0.5 * cast), rgb(0.62, 0.50, 0.44), chimney)


def _flat(b: Seen, noise: Stack, footprint_m: Array) -> Array:
    """(3, K) a flat roof: membrane or gravel, seams, stains, parapet, skylights and machines with shadows."""
    unit_p, unit_q = (a / np.hypot(*b.shadow) for a in b.shadow)
    light = 1 + 0.05 * (noise[0] + noise[1] + noise[2]) + 0.10 * (noise[4] + noise[5] + noise[6])
    light = light - 0.10 * shapes.stripe(shapes.repeated(b.p, 3.0), 0.06, footprint_m)
    rim = np.minimum(b.half_p - np.abs(b.p), b.half_q - np.abs(b.q))
    # The parapet is lit, and on the sun's side it throws a strip of shadow onto the roof.
    from_p, from_q = b.p * np.sign(unit_p) + b.half_p, b.q * np.sign(unit_q) + b.half_q
    dark = np.maximum(*(shapes.stripe(a - 0.55, 0.25, footprint_m) for a in (from_p, from_q)))
    light = light + 0.16 * shapes.inside(rim - 0.3, footprint_m) - 0.32 * dark * (rim > 0.3)
    roof = _palette(FLAT_COLOURS, b.code) * light
    i, j = np.floor(b.p / 5.5 + 0.5).astype(np.int64), np.floor(b.q / 5.0 + 0.5).astype(np.int64)
    code = hash_cells(51, b.code, i, j)
    there, half = (uniform(code) < 0.45) & (rim > 1.5), 0.5 + 0.7 * uniform(code, 2)
    p, q = b.p - i * 5.5, b.q - j * 5.0
    roof = roof * (1 - 0.55 * there * shapes.box(p - 0.9 * unit_p, q - 0.9 * unit_q, half, 0.75, footprint_m))
    top = np.where(uniform(code, 3) < 0.3, 0.30, 0.78) * (1 + 0.2 * (noise[1] + noise[2]))
    return shapes.blend(roof, np.stack([top, top, 1.02 * top]), there * shapes.box(p, q, half, 0.75, footprint_m))
