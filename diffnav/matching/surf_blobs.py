"""SURF's detector: peaks, over place and scale, of the determinant of a Hessian of box filters (Bay et al. 2008)."""

from typing import NamedTuple

import cv2
import numpy as np

# The 9 x 9 filter stands for Gaussian derivatives of sigma 1.2 px, every larger one in proportion.
_SCALE_PER_SIZE = 1.2 / 9
# The article's balance between the errors of the box filters. At straight edges askew to the axes some det H is left
# all the same: with little contrast elsewhere, the black border of a turned picture attracts a third of the blobs.
_DXY_WEIGHT = 0.9


class Blobs(NamedTuple):
    """Blobs of one image, the strongest first: x, y and scale s in pixels, and det H there, each (N,) float64."""

    x: np.ndarray
    y: np.ndarray
    scale: np.ndarray
    response: np.ndarray


def filter_sizes(octave: int) -> tuple[int, int, int, int]:
    """Sides in pixels of the octave's four filters: 9, 15, 21, 27; then 15, 27, 39, 51; and so on (octaves from 0)."""
    first, second, third, fourth = (3 * (2 ** (octave + 1) * layer + 1) for layer in (1, 2, 3, 4))
    return first, second, third, fourth


def find_blobs(sums: np.ndarray, most: int, octaves: int = 4, threshold: float = 0.0) -> Blobs:
    """At most `most` blobs of the image whose `integral_image` is given.

    Args:
        octaves: how many; each samples the image half as densely as the one before, with larger filters. One whose
            filters do not fit into the image is left out.
        threshold: the least det H, of the picture in [0, 1]; 0 takes every peak.
    Octaves overlap, and a blob between two of them peaks in both, a little apart; two alike descriptors would then
    fail the ratio test. So of two blobs less than s (the smaller one's) from another the stronger stays; the article
    does not say what it does there.
    """
    found = [np.zeros((4, 0))]
    for octave in range(octaves):
        sizes = filter_sizes(octave)
        step = 2**octave
        if sizes[-1] + 2 * step > min(sums.shape) - 1:
            break
        found.append(_octave_peaks(sums, sizes, step, threshold))
    table = np.concatenate(found, 1)
    table = table[:, np.argsort(-table[3], kind="stable")]
    return Blobs(*table[:, _distinct(table, most)])


def hessian_determinant(sums: np.ndarray, size: int, step: int, margin: int) -> np.ndarray:
    """det H by box filters of `size` px, per filter area, of the picture in [0, 1]: (h, w) float32.

    At the pixels y, x = margin, margin + step, ... as far as H - 1 - margin, W - 1 - margin; margin >= size // 2.
    """
    height, width = sums.shape[0] - 1, sums.shape[1] - 1
    lobe, half = size // 3, size // 2
    core = lobe // 2

    def rows(offset: int) -> np.ndarray:
        return sums[margin + offset : height - margin + offset : step]

    def columns(strips: np.ndarray, offset: int) -> np.ndarray:
        return strips[:, margin + offset : width - margin + offset : step]

    # Three lobes side by side weigh 1, -2, 1: the whole less three times the middle one.
    band = rows(lobe) - rows(1 - lobe)
    dxx = columns(band, half + 1) - columns(band, -half) - 3 * (columns(band, core + 1) - columns(band, -core))
    lobes = rows(half + 1) - rows(-half) - 3 * (rows(core + 1) - rows(-core))
    dyy = columns(lobes, lobe) - columns(lobes, 1 - lobe)
    # Four squares around the pixel, its own row and column left out.
    squares = rows(0) - rows(-lobe) - rows(lobe + 1) + rows(1)
    dxy = columns(squares, 0) - columns(squares, -lobe) - columns(squares, lobe + 1) + columns(squares, 1)
    determinant = dxx * dyy - (_DXY_WEIGHT * dxy) ** 2
    return (determinant / (255 * size**2) ** 2).astype(np.float32)


def _octave_peaks(sums: np.ndarray, sizes: tuple[int, int, int, int], step: int, threshold: float) -> np.ndarray:
    """x, y, scale and response of the octave's peaks, (4, N)."""
    margin = sizes[-1] // 2
    layers = np.stack([hessian_determinant(sums, size, step, margin) for size in sizes])
    cubes, where = peak_cubes(layers, threshold)
    offset, exists = quadratic_peaks(cubes)
    layer, y, x = (where + offset)[exists].T
    size = sizes[0] + layer * (sizes[1] - sizes[0])
    return np.stack([margin + step * x, margin + step * y, _SCALE_PER_SIZE * size, cubes[exists, 1, 1, 1]])


def peak_cubes(layers: np.ndarray, threshold: float) -> tuple[np.ndarray, np.ndarray]:
    """The 3 x 3 x 3 surroundings (N, 3, 3, 3) of the peaks of `layers` (L, h, w), and where these are, (N, 3).

    A peak exceeds `threshold` and is the greatest of its surroundings; of equal neighbours the first is one.
    """
    around = np.stack([cv2.dilate(layer, np.ones((3, 3), np.uint8)) for layer in layers])
    greatest = np.maximum(np.maximum(around[:-2], around[1:-1]), around[2:])
    inner = layers[1:-1]
    peaks = (inner >= greatest) & (inner > threshold)
    where = np.argwhere(peaks[:, 1:-1, 1:-1]) + 1
    windows = np.lib.stride_tricks.sliding_window_view(layers, (3, 3, 3))
    cubes = windows[tuple((where - 1).T)].astype(np.float64)
    first = cubes.reshape(-1, 27).argmax(1) == 13
    return cubes[first], where[first]


def quadratic_peaks(cubes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where, from each cube's centre, its quadratic fit peaks (N, 3), and whether that is within one sample (N,).

    Brown and Lowe 2002, with derivatives by central differences. Up to one sample, not half: where two neighbours'
    fits each point to the other by a little more than half, both peaks would be lost.
    """
    gradient = np.empty((len(cubes), 3))
    hessian = np.empty((len(cubes), 3, 3))
    for i in range(3):
        behind, centre, ahead = np.moveaxis(cubes, i + 1, 0)
        slope = (ahead - behind) / 2
        gradient[:, i] = slope[:, 1, 1]
        hessian[:, i, i] = (ahead + behind - 2 * centre)[:, 1, 1]
        for j in range(i):
            slope_behind, _, slope_ahead = np.moveaxis(slope, j + 1, 0)
            hessian[:, i, j] = hessian[:, j, i] = (slope_ahead - slope_behind)[:, 1] / 2
    largest = np.abs(hessian).max((1, 2), initial=0)
    solvable = np.abs(np.linalg.det(hessian)) > 1e-9 * largest**3
    offset = np.full_like(gradient, np.inf)
    offset[solvable] = -np.linalg.solve(hessian[solvable], gradient[solvable, :, None])[..., 0]
    return offset, np.all(np.abs(offset) < 1, axis=1)


def _distinct(table: np.ndarray, most: int) -> list[int]:
    """The first `most` columns of (x, y, scale, response) that are no nearer to an earlier one than either's scale."""
    place, scale = table[0] + 1j * table[1], table[2]
    kept_place, kept_scale = np.empty(most, complex), np.empty(most)
    kept: list[int] = []
    for i in range(len(scale)):
        n = len(kept)
        if n == most:
            break
        if not (np.abs(kept_place[:n] - place[i]) < np.minimum(kept_scale[:n], scale[i])).any():
            kept_place[n], kept_scale[n] = place[i], scale[i]
            kept.append(i)
    return kept
