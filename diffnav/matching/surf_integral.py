"""The integral image and what SURF's descriptor reads from it: Haar wavelet responses anywhere (Bay et al. 2008)."""

import cv2
import numpy as np


def integral_image(grey: np.ndarray) -> np.ndarray:
    """For each corner (y, x) between pixels, the sum of all pixels above and left of it: (H + 1, W + 1) float64.

    grey: (H, W) uint8. The sums are whole numbers, hence exact: a box's is the same wherever the box lies.
    """
    return cv2.integral(grey, sdepth=cv2.CV_64F)


def haar_responses(sums: np.ndarray, x: np.ndarray, y: np.ndarray, half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(dx, dy): right less left half, and lower less upper half, of squares of side 2 `half` about the points x, y.

    Neither places nor sizes are bound to whole pixels: between pixel corners the integral image is interpolated, which
    is exact for an image made of square pixels. Rounding them, as is common, costs a sixth of the correct matches
    between turned pictures. Beyond its border the image goes on as its outermost pixels.

    Args: sums: the `integral_image`. x, y, half: in pixels, of shapes that broadcast.
    """
    height, width = sums.shape[0] - 1, sums.shape[1] - 1
    left, centre, right = (_whole_and_part(x + 0.5 + shift, width) for shift in (-half, 0, half))
    upper, middle, lower = (_whole_and_part(y + 0.5 + shift, height) for shift in (-half, 0, half))
    a, b = _sum_before(sums, upper, left), _sum_before(sums, upper, right)
    c, d = _sum_before(sums, lower, left), _sum_before(sums, lower, right)
    dx = (d - b) + (c - a) - 2 * (_sum_before(sums, lower, centre) - _sum_before(sums, upper, centre))
    dy = (d - c) + (b - a) - 2 * (_sum_before(sums, middle, right) - _sum_before(sums, middle, left))
    return dx, dy


def _whole_and_part(edge: np.ndarray, length: int) -> tuple[np.ndarray, np.ndarray]:
    """`edge` as the index of the pixel it cuts and the rest, outside [0, 1] only beyond the image."""
    whole = np.floor(edge).clip(0, length - 1)
    return whole.astype(np.int64), edge - whole


def _sum_before(
    sums: np.ndarray, row: tuple[np.ndarray, np.ndarray], column: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """The sum of all pixels above `row` and left of `column`, each given as whole pixels and a part of one."""
    stride = sums.shape[1]
    # One flat index and `take`: four times as fast as indexing with rows and columns.
    flat, corner = sums.ravel(), row[0] * stride + column[0]
    above, below = flat.take(corner), flat.take(corner + stride)
    above = above + column[1] * (flat.take(corner + 1) - above)
    below = below + column[1] * (flat.take(corner + stride + 1) - below)
    return above + row[1] * (below - above)
