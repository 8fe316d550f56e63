"""Patterns on the street's planes: noise and tiles that fade where a pixel covers more than they show.

Positions u, v are (N,) float64 metres on a plane, footprints (N,) metres that a pixel covers along each.
"""

import numpy as np

from diffnav.data.scenery.noise import Array, hash_cells, salted, uniform, value_noise

SPACINGS_M = (0.04, 0.14, 0.5, 1.7)


def grain(seed: int, u: Array, v: Array, footprint_m: Array) -> Array:
    """(N,) float32 noise about 0, standard deviation about .2: octaves of SPACINGS_M of one amplitude."""
    total = np.zeros(u.shape, np.float32)
    for k, spacing in enumerate(SPACINGS_M):
        # Exactly zero where it no longer matters, so that leaving it out there changes nothing.
        weight = np.maximum(np.exp(-0.7 * (footprint_m / spacing) ** 2) - 0.02, 0) / 0.98
        near = np.flatnonzero(weight)
        if near.size:
            total[near] += 0.3 * weight[near] * value_noise(salted(seed, k), u[near], v[near], spacing)[0]
    return total


def tiles(
    code: Array | int,
    u: Array,
    v: Array,
    sides_m: tuple[Array | float, Array | float],
    footprints_m: tuple[Array, Array],
) -> Array:
    """(N,) float32 in [0, 1]: a random tone for each tile of a grid, box-filtered at its edges, .5 where too fine.

    code: of the grid, one for all points or (N,) integers. sides_m: of a tile along u and v.
    """
    # Of one element at least: numpy warns when a lone number overflows, as hashes do.
    code = np.atleast_1d(code)
    (i, next_i, share_u), (j, next_j, share_v) = (
        _blend(p, side, foot) for p, side, foot in zip((u, v), sides_m, footprints_m, strict=True)
    )
    first = (1 - share_v) * uniform(hash_cells(51, code, i, j)) + share_v * uniform(hash_cells(51, code, i, next_j))
    other = uniform(hash_cells(51, code, next_i, j)), uniform(hash_cells(51, code, next_i, next_j))
    second = (1 - share_v) * other[0] + share_v * other[1]
    coarseness = np.maximum(footprints_m[0] / sides_m[0], footprints_m[1] / sides_m[1])
    return 0.5 + np.clip(1.5 - coarseness, 0, 1) * ((1 - share_u) * first + share_u * second - 0.5)


def _blend(p: Array, side_m: Array | float, footprint_m: Array) -> tuple[Array, Array, Array]:
    """The tile of each position, its nearest neighbour, and the neighbour's share of the pixel, 0 to .5."""
    place = p / side_m
    tile = np.floor(place)
    offset = place - tile - 0.5
    share = np.clip(0.5 - (0.5 - np.abs(offset)) * side_m / footprint_m, 0, 0.5)
    return tile.astype(np.int64), (tile + np.where(offset < 0, -1, 1)).astype(np.int64), share
