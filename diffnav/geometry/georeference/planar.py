"""What a georeference is: pixels <-> latitude, longitude; by a plane in between for those that describe a picture."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from diffnav.geometry.geodesy import Array, wrapped_deg
from diffnav.geometry.georeference.planes import Plane
from diffnav.geometry.georeference.soundness import require_sound


class Georeference(Protocol):
    """Where the pixels of a map lie: points (..., 2) as x, y pixels <-> latitude, longitude in degrees.

    Integer points are pixel centres, the first pixel's centre is (0, 0). Both ways go on beyond the map's edges.
    """

    @property
    def size(self) -> tuple[int, int]:
        """(h, w) in pixels."""

    def latlon(self, points: ArrayLike) -> Array:
        """Places (..., 2) of pixels (..., 2): latitude, cut off at the poles; longitude in [-180, 180)."""

    def pixels(self, latlon: ArrayLike) -> Array:
        """Pixels (..., 2) of places (..., 2): the inverse; not finite for a place that the map's plane cannot show."""


@dataclass(frozen=True)
class PlanarGeoreference:
    """A georeference by way of a plane: its kinds say how pixels lie in the plane.

    Raises: ImpossibleBoundsError, ValueError if the map cannot be as it is described (`soundness`).
    """

    size: tuple[int, int]
    plane: Plane

    def __post_init__(self) -> None:
        require_sound(self)

    def to_plane(self, points: Array) -> Array:
        """Pixels (..., 2) -> x, y in the plane (..., 2)."""
        raise NotImplementedError

    def from_plane(self, xy: Array) -> Array:
        """The inverse."""
        raise NotImplementedError

    def latlon(self, points: ArrayLike) -> Array:
        found = self.unwrapped_latlon(points)
        return np.stack([np.clip(found[..., 0], -90, 90), wrapped_deg(found[..., 1])], -1)

    def pixels(self, latlon: ArrayLike) -> Array:
        places = np.asarray(latlon, np.float64)
        # The turn in which the map lies: one over the antimeridian has longitudes beyond 180 in its plane.
        longitude = self._middle_deg + wrapped_deg(places[..., 1] - self._middle_deg)
        return self.from_plane(self.plane.xy(np.stack([places[..., 0], longitude], -1)))

    def unwrapped_latlon(self, points: ArrayLike) -> Array:
        """As the numbers that describe the map say: latitudes beyond the poles, longitudes of any turn."""
        return self.plane.latlon(self.to_plane(np.asarray(points, np.float64)))

    @cached_property
    def _middle_deg(self) -> float:
        height, width = self.size
        return float(self.unwrapped_latlon([(width - 1) / 2, (height - 1) / 2])[1])
