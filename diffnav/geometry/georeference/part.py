"""Georeferences of a window of a map and of a map of another size."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from diffnav.geometry.geodesy import Array
from diffnav.geometry.georeference.planar import Georeference


@dataclass(frozen=True)
class _Part:
    """Pixels p of the part are pixels (p + 0.5) / scale - 0.5 + start of the whole; both (2,) in x, y."""

    size: tuple[int, int]
    whole: Georeference
    start: tuple[float, float]
    scale: tuple[float, float]

    def latlon(self, points: ArrayLike) -> Array:
        return self.whole.latlon((np.asarray(points, np.float64) + 0.5) / self.scale - 0.5 + self.start)

    def pixels(self, latlon: ArrayLike) -> Array:
        return (self.whole.pixels(latlon) - self.start + 0.5) * self.scale - 0.5


def cropped(georeference: Georeference, window: tuple[int, int, int, int]) -> Georeference:
    """The georeference of a window (top, left, height, width) of a map; the window may reach over its edges.

    Raises: ValueError for a window without pixels.
    """
    top, left, height, width = window
    if height < 1 or width < 1:
        raise ValueError(f"need a window of 1 x 1 pixels or more, got {width} x {height}")
    return _Part((height, width), georeference, (left, top), (1.0, 1.0))


def scaled(georeference: Georeference, size: tuple[int, int]) -> Georeference:
    """The georeference of a map resized to `size` (h, w), as `images.resize` does it: outer edges stay.

    Raises: ValueError for a size without pixels.
    """
    height, width = size
    if height < 1 or width < 1:
        raise ValueError(f"need a size of 1 x 1 pixels or more, got {width} x {height}")
    before = georeference.size
    return _Part(size, georeference, (0.0, 0.0), (width / before[1], height / before[0]))
