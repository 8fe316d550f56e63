"""A camera that looks straight along the street."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray


@dataclass(frozen=True)
class StreetCamera:
    """A pinhole camera with its axes along the street's.

    position_m: x, y, z; y is negative above the road. focal_px: focal length. size: (h, w). The optical axis meets
    the picture in its middle, ((w - 1) / 2, (h - 1) / 2); integers are pixel centres.
    """

    position_m: tuple[float, float, float]
    focal_px: float
    size: tuple[int, int]

    def project(self, points_m: Array) -> Array:
        """(N, 2) pixels x, y of points (N, 3) in the street's frame that lie before the camera."""
        x, y, z = (np.asarray(points_m, np.float64) - self.position_m).T
        h, w = self.size
        return np.stack([(w - 1) / 2 + self.focal_px * x / z, (h - 1) / 2 + self.focal_px * y / z], 1)

    def rays(self) -> tuple[Array, Array]:
        """Slopes of the pixels' rays: x / z of each column (w,) and y / z of each row (h,), float64."""
        h, w = self.size
        return (np.arange(w) - (w - 1) / 2) / self.focal_px, (np.arange(h) - (h - 1) / 2) / self.focal_px
