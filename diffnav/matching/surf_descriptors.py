"""SURF's orientations and descriptors: sums of Haar wavelet responses around blobs (Bay et al. 2008)."""

import numpy as np

from diffnav.matching.surf_blobs import Blobs
from diffnav.matching.surf_integral import haar_responses

# Blobs whose samples are read at a time: these then stay in the processor's cache.
_AT_ONCE = 25
# Where samples lie around a blob, in its scale s, as x and y: for its orientation the 113 in a disc of radius 6,
_DISC = np.stack([offset for offset in np.mgrid[-6:7, -6:7].reshape(2, -1).T if np.hypot(*offset) <= 6], 1)
# for its descriptor 20 x 20.
_SQUARE = np.stack(np.meshgrid(np.arange(20) - 9.5, np.arange(20) - 9.5)).reshape(2, -1)


def orientations(sums: np.ndarray, blobs: Blobs) -> np.ndarray:
    """The direction of each blob, (N,) radians from x towards y (clockwise as seen).

    Responses of wavelets 4 s wide, at steps of s within 6 s, weighted by a Gaussian of 2 s; of all windows of pi / 3
    the one that starts at a response's direction and whose responses add up to the longest vector gives its direction.
    """
    weight = np.exp(-(_DISC**2).sum(0) / (2 * 2.0**2))
    dx, dy = _responses(sums, blobs, np.zeros(len(blobs.x)), _DISC, 2.0)
    return longest_windows(weight * dx, weight * dy)


def describe(sums: np.ndarray, blobs: Blobs, directions: np.ndarray, extended: bool = False) -> np.ndarray:
    """Descriptors of length 1, (N, 64), or (N, 128) if `extended`.

    A square of 20 s along the direction has 4 x 4 parts of 5 x 5 samples, of wavelets 2 s wide, turned into the
    direction's frame and weighted by a Gaussian of 3.3 s. A part gives the sums of dx, dy, |dx| and |dy|; extended,
    those of dx and |dx| once where dy >= 0 and once where dy < 0, and likewise of dy and |dy| by the sign of dx.
    """
    weight = np.exp(-(_SQUARE**2).sum(0) / (2 * 3.3**2))
    along, across = _responses(sums, blobs, directions, _SQUARE, 1.0)
    cos, sin = np.cos(directions)[:, None], np.sin(directions)[:, None]
    dx, dy = weight * (cos * along + sin * across), weight * (cos * across - sin * along)
    if extended:
        right, down = dx >= 0, dy >= 0
        terms = [dx * down, np.abs(dx) * down, dx * ~down, np.abs(dx) * ~down]
        terms += [dy * right, np.abs(dy) * right, dy * ~right, np.abs(dy) * ~right]
    else:
        terms = [dx, dy, np.abs(dx), np.abs(dy)]
    parts = np.stack([term.reshape(-1, 4, 5, 4, 5).sum((2, 4)) for term in terms], -1)
    flat = parts.reshape(len(parts), 16 * len(terms))
    return flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), np.finfo(flat.dtype).tiny)


def _responses(
    sums: np.ndarray, blobs: Blobs, directions: np.ndarray, offsets: np.ndarray, half: float
) -> tuple[np.ndarray, np.ndarray]:
    """(dx, dy), each (N, K), of upright wavelets 2 `half` s wide at `offsets` (2, K), in s, turned by `directions`."""
    responses = np.empty((2, len(directions), offsets.shape[1]))
    for start in range(0, len(directions), _AT_ONCE):
        some = slice(start, start + _AT_ONCE)
        scale = blobs.scale[some, None]
        cos, sin = scale * np.cos(directions[some, None]), scale * np.sin(directions[some, None])
        x = blobs.x[some, None] + cos * offsets[0] - sin * offsets[1]
        y = blobs.y[some, None] + sin * offsets[0] + cos * offsets[1]
        responses[:, some] = haar_responses(sums, x, y, half * scale)
    return responses[0], responses[1]


def longest_windows(dx: np.ndarray, dy: np.ndarray) -> np.ndarray:
    """Direction (N,) of the longest sum of the vectors (dx, dy) (N, K) whose own directions span less than pi / 3."""
    n, k = dx.shape
    angle = np.arctan2(dy, dx)
    order = angle.argsort(1, kind="stable")
    angle = np.take_along_axis(angle, order, 1)
    # Twice around, so that a window may pass pi; rows lie far apart on one line, for one search through all.
    row = 10 * np.arange(n)[:, None]
    line = np.concatenate([angle, angle + 2 * np.pi], 1) + row * np.pi
    end = np.searchsorted(line.ravel(), (line[:, :k] + np.pi / 3).ravel()).reshape(n, k) - 2 * k * np.arange(n)[:, None]
    sums = []
    for component in (dx, dy):
        turn = np.take_along_axis(component, order, 1)
        total = np.concatenate([np.zeros((n, 1)), np.cumsum(np.concatenate([turn, turn], 1), 1)], 1)
        sums.append(np.take_along_axis(total, end, 1) - total[:, :k])
    longest = np.hypot(*sums).argmax(1)
    return np.arctan2(*(component[np.arange(n), longest] for component in reversed(sums)))
