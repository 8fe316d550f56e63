"""How much of a pixel a shape covers: signed distances and box-filtered edges, so that nothing aliases.

Distances are metres, negative inside; `footprint_m` is the side of a pixel on the ground; coverages are in
[0, 1].
"""

import numpy as np

from diffnav.data.scenery.noise import Array


def inside(distance_m: Array, footprint_m: Array) -> Array:
    """Coverage of a pixel by a shape larger than it, from the signed distance of its centre."""
    return np.clip(0.5 - distance_m / footprint_m, 0.0, 1.0)


def stripe(offset_m: Array, half_width_m: Array | float, footprint_m: Array) -> Array:
    """Coverage by a stripe that may be thinner than a pixel: the overlap of two intervals."""
    half = 0.5 * footprint_m
    high = np.clip(offset_m + half, -half_width_m, half_width_m)
    low = np.clip(offset_m - half, -half_width_m, half_width_m)
    return (high - low) / footprint_m


def box_distance(p: Array, q: Array, half_p: Array | float, half_q: Array | float) -> Array:
    """Signed distance to a rectangle about the origin (exact inside and at its sides)."""
    dp, dq = np.abs(p) - half_p, np.abs(q) - half_q
    outside = np.sqrt(np.maximum(dp, 0) ** 2 + np.maximum(dq, 0) ** 2)
    return outside + np.minimum(np.maximum(dp, dq), 0)


def box(p: Array, q: Array, half_p: Array | float, half_q: Array | float, footprint_m: Array) -> Array:
    """Coverage by a rectangle, also one smaller than a pixel."""
    return stripe(p, half_p, footprint_m) * stripe(q, half_q, footprint_m)


def wave(phase_m: Array, length_m: Array | float, footprint_m: Array) -> Array:
    """cos(2 pi phase / length), averaged over a pixel: rows too fine to see fade to zero."""
    turn = phase_m / length_m
    return np.cos(np.float32(2 * np.pi) * (turn - np.floor(turn))) * np.maximum(np.sinc(footprint_m / length_m), 0)


def repeated(offset_m: Array, period_m: Array | float) -> Array:
    """Offset from the nearest of lines `period_m` apart."""
    return offset_m - period_m * np.floor(offset_m / period_m + 0.5)


def blend(colour: Array, other: Array, cover: Array) -> Array:
    """(3, N) colour under another, (3, N) or (3, 1), of coverage (N,)."""
    return colour + (other - colour) * cover
