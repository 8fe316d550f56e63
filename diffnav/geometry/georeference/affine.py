"""Georeferences by six numbers: pixels lie evenly in a plane, perhaps turned."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from diffnav.geometry.geodesy import Array
from diffnav.geometry.georeference.planar import PlanarGeoreference

Transform = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class AffineGeoreference(PlanarGeoreference):
    """Pixels (x, y) lie at (a x + b y + c, d x + e y + f) in the plane: c, f is the centre of the first pixel.

    size: (h, w). plane: in which the numbers count. transform: a, b, c, d, e, f.
    Raises: ImpossibleBoundsError, ValueError (`soundness`).
    """

    transform: Transform

    def __post_init__(self) -> None:
        if len(self.transform) != 6 or not np.isfinite(self.transform).all():
            raise ValueError(f"its transform must be six finite numbers, got {list(self.transform)}")
        a, b, _, d, e, _ = self.transform
        if a * e == b * d:
            raise ValueError("it has no area: its corners or pixel sizes lie on one line or in one point")
        super().__post_init__()

    def to_plane(self, points: Array) -> Array:
        return points @ self._matrix.T + self._start

    def from_plane(self, xy: Array) -> Array:
        # The start is subtracted first: in metres of a UTM zone it has seven digits that the pixels need.
        return (xy - self._start) @ self._inverse.T

    @cached_property
    def _matrix(self) -> Array:
        a, b, _, d, e, _ = self.transform
        return np.array([[a, b], [d, e]], np.float64)

    @cached_property
    def _inverse(self) -> Array:
        return np.linalg.inv(self._matrix).astype(np.float64)

    @cached_property
    def _start(self) -> Array:
        return np.array([self.transform[2], self.transform[5]], np.float64)


def from_outer_corner(transform: Sequence[float]) -> Transform:
    """The transform (a, b, c, d, e, f) for pixel centres, of one whose c, f is the first pixel's outer corner.

    GeoTIFF and GDAL count so; world files count as we do.
    """
    a, b, c, d, e, f = (float(number) for number in transform)
    return a, b, c + (a + b) / 2, d, e, f + (d + e) / 2
