"""Planes in which the pixels of a map lie evenly: degrees, Web-Mercator, metres around a place.

Every plane has x towards the east and y towards the north. Longitudes go through unwrapped: a map that runs from 175
over the antimeridian has x, and gives longitudes, up to 185.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from diffnav.geometry.geodesy import Array, moved, offset_m

# Of the sphere onto which Web-Mercator (EPSG:3857) puts the latitudes of the ellipsoid.
_MERCATOR_RADIUS_M = 6_378_137.0


class Plane(Protocol):
    """A map projection: x, y in units of its own <-> latitude, longitude in degrees, arrays (..., 2)."""

    def latlon(self, xy: Array) -> Array:
        """Latitudes as the numbers say, beyond 90 too; longitudes of any turn."""

    def xy(self, latlon: Array) -> Array:
        """The inverse; a place that the plane cannot show has coordinates that are not finite."""


@dataclass(frozen=True)
class Degrees:
    """x is the longitude, y the latitude (EPSG:4326, longitude first)."""

    def latlon(self, xy: Array) -> Array:
        return xy[..., ::-1]

    def xy(self, latlon: Array) -> Array:
        return latlon[..., ::-1]


@dataclass(frozen=True)
class WebMercator:
    """Metres of Web-Mercator (EPSG:3857), which are longer than those of the ground by 1 / cos(latitude)."""

    def latlon(self, xy: Array) -> Array:
        latitude = np.arctan(np.sinh(xy[..., 1] / _MERCATOR_RADIUS_M))
        return np.degrees(np.stack([latitude, xy[..., 0] / _MERCATOR_RADIUS_M], -1))

    def xy(self, latlon: Array) -> Array:
        latitude, longitude = np.radians(latlon[..., 0]), np.radians(latlon[..., 1])
        return _MERCATOR_RADIUS_M * np.stack([longitude, np.arcsinh(np.tan(latitude))], -1)


@dataclass(frozen=True)
class LocalMetres:
    """Metres east and north of `origin`, its latitude and longitude in degrees (`geodesy.offset_m`)."""

    origin: tuple[float, float]

    def __post_init__(self) -> None:
        # Raises for an origin that is no place.
        offset_m(self.origin, self.origin)

    def latlon(self, xy: Array) -> Array:
        return moved(self.origin, xy)

    def xy(self, latlon: Array) -> Array:
        return offset_m(self.origin, latlon)
