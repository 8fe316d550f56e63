"""Hashed randomness over the plane: the same number at the same place, whatever else is rendered.

Integer hashing of cell coordinates replaces a random generator, so the world needs no state, no order and no
end. All arrays are numpy; positions are float64 metres (far from the origin float32 would lose them), values
float32.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray
SPACINGS_M = (0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 12.8, 25.6, 51.2, 102.4)


def mix(h: Array) -> Array:
    """uint32 scrambled: every input bit reaches every output bit (C. Wellons' lowbias32)."""
    h = (h ^ (h >> np.uint32(16))) * np.uint32(0x7FEB352D)
    h ^= h >> np.uint32(15)
    h *= np.uint32(0x846CA68B)
    h ^= h >> np.uint32(16)
    return h


def salted(seed: int, salt: int) -> int:
    """An independent 32-bit seed for one use; seeds of any size count with all their bits."""
    h = (salt * 0x9E3779B1 + 0x3C6EF372) & 0xFFFFFFFF
    while True:
        h = int(mix(np.array([h ^ (seed & 0xFFFFFFFF)], np.uint32))[0])
        seed >>= 32
        if seed in (0, -1):
            return h ^ (seed & 0x5BD1E995)


def hash_cells(seed: int, *cells: Array) -> Array:
    """uint32 hash of integer coordinates, broadcast together; coordinates count modulo 2^32."""
    h = np.full((), seed, np.uint32)
    for cell in cells:
        h = mix(np.asarray(cell).astype(np.uint32) * np.uint32(0x9E3779B1) ^ h)
    return h


def uniform(h: Array, salt: int = 0) -> Array:
    """float32 in [0, 1) from a hash; different salts give independent numbers."""
    if salt:
        h = mix(h + np.uint32((salt * 0x9E3779B1) & 0xFFFFFFFF))
    return (h >> np.uint32(8)).astype(np.float32) * np.float32(2.0**-24)


def uniform_pair(h: Array) -> tuple[Array, Array]:
    """Two float32 numbers in [0, 1) from the two halves of a hash."""
    scale = np.float32(2.0**-16)
    return (h & np.uint32(0xFFFF)).astype(np.float32) * scale, (h >> np.uint32(16)).astype(np.float32) * scale


def value_noise(seed: int, x: Array, y: Array, spacing_m: float) -> tuple[Array, Array]:
    """Two independent smooth noises in [-1, 1], standard deviation about 0.37, that vary over `spacing_m`.

    x, y: (N,) float64, metres. The lattice is turned by a seeded angle, so that no two octaves line up.
    """
    angle = seed / 2**32 * 2 * np.pi
    c, s = np.cos(angle) / spacing_m, np.sin(angle) / spacing_m
    u, v = c * x - s * y, s * x + c * y
    i, j = np.floor(u), np.floor(v)
    fu, fv = (u - i).astype(np.float32), (v - j).astype(np.float32)
    wu, wv = fu * fu * (3 - 2 * fu), fv * fv * (3 - 2 * fv)
    i0 = i.astype(np.int64).astype(np.uint32) * np.uint32(0x9E3779B1)
    j0 = j.astype(np.int64).astype(np.uint32) * np.uint32(0x85EBCA77) + np.uint32(seed)
    i1, j1 = i0 + np.uint32(0x9E3779B1), j0 + np.uint32(0x85EBCA77)
    a = [uniform_pair(mix(p ^ mix(q))) for q in (j0, j1) for p in (i0, i1)]
    noises = []
    for k in (0, 1):
        low = a[0][k] + wu * (a[1][k] - a[0][k])
        high = a[2][k] + wu * (a[3][k] - a[2][k])
        noises.append(2 * (low + wv * (high - low)) - 1)
    return noises[0], noises[1]


def octaves(seed: int, x: Array, y: Array, footprint_m: Array) -> tuple[list[Array], list[Array]]:
    """Two stacks of noise, an array for each of SPACINGS_M; octaves finer than a pixel fade out.

    Octaves of one amplitude, each twice as coarse as the last, have the 1/f amplitude spectrum of natural
    images.
    """
    first, second = [], []
    for k, spacing in enumerate(SPACINGS_M):
        # Exactly zero where it no longer matters, so that skipping an octave changes no pixel.
        weight = np.maximum(np.exp(-0.7 * (footprint_m / spacing) ** 2) - 0.02, 0) / 0.98
        if not weight.any():
            a = b = np.zeros_like(x, dtype=np.float32)
        else:
            a, b = value_noise(salted(seed, 900 + k), x, y, spacing)
        first.append(a * weight)
        second.append(b * weight)
    return first, second


def group(*cells: Array) -> tuple[Array, Array]:
    """Index of one member of each distinct tuple of integers, (M,), and each element's group, (N,)."""
    key = np.zeros(cells[0].shape, np.uint64)
    for cell in cells:
        # Two hashes side by side: 64 bits make a collision within a window improbable (below 1e-9).
        low, high = key.astype(np.uint32), (key >> np.uint64(32)).astype(np.uint32)
        c = np.asarray(cell).astype(np.uint32)
        key = mix(c ^ mix(low + np.uint32(1))).astype(np.uint64)
        key |= mix(c * np.uint32(0x85EBCA77) ^ mix(high + np.uint32(2))).astype(np.uint64) << np.uint64(32)
    _, index, inverse = np.unique(key, return_index=True, return_inverse=True)
    return index, inverse.reshape(-1)


def neighbourhood(x: Array, y: Array, cell_m: float) -> tuple[Array, Array, Array]:
    """The square cells around points: what may reach a point lies in the 3 x 3 cells about it.

    Returns: i, j (M,) int64, the distinct cells touched; table (N, 9), each point's nine cells as indices
    into them.
    """
    i, j = np.floor(x / cell_m).astype(np.int64), np.floor(y / cell_m).astype(np.int64)
    index, inverse = group(i, j)
    di, dj = np.meshgrid([-1, 0, 1], [-1, 0, 1], indexing="ij")
    around_i, around_j = (i[index, None] + di.reshape(-1)), (j[index, None] + dj.reshape(-1))
    distinct, where = group(around_i.reshape(-1), around_j.reshape(-1))
    table = where.reshape(-1, 9)[inverse]
    return around_i.reshape(-1)[distinct], around_j.reshape(-1)[distinct], table
