"""Planes of any coordinate reference system, by pyproj, and the plane that a name or description stands for."""

import warnings
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from diffnav.errors import UserError
from diffnav.geometry.geodesy import Array, wrapped_deg
from diffnav.geometry.georeference.planes import Degrees, LocalMetres, Plane, WebMercator

_DEGREES = frozenset({"EPSG:4326", "OGC:CRS84", "CRS84", "WGS84"})
_WEB_MERCATOR = frozenset({"EPSG:3857", "EPSG:900913"})
# PROJ undoes a datum shift to a millimetre only: the fixed point gains five digits a turn.
_REFINEMENTS = 2
_AREA_DEG = 0.01


@dataclass(frozen=True)
class Projected:
    """The plane of a coordinate reference system, in its own units, x (east) first whatever its axes' order.

    crs: what pyproj understands: `EPSG:26914`, WKT, a PROJ string. near: x, y of a place in the map, for which the
    best transformation to WGS-84 is chosen; that one alone serves, so that the way back meets the way there.
    Raises: UserError without pyproj; ValueError if the system is unknown or has no place on the earth.
    """

    crs: str
    near: tuple[float, float]

    def __post_init__(self) -> None:
        _operation(self.crs, self.near)

    def latlon(self, xy: Array) -> Array:
        transformer, _ = _operation(self.crs, self.near)
        longitude, latitude = transformer.transform(xy[..., 0], xy[..., 1])
        return np.stack([latitude, longitude], -1)

    def xy(self, latlon: Array) -> Array:
        xy = self._xy(latlon)
        for _ in range(_REFINEMENTS):
            with np.errstate(invalid="ignore"):
                better = xy + self._xy(latlon) - self._xy(self._beside(latlon, self.latlon(xy)))
            xy = np.where(np.isfinite(better), better, xy)
        return xy

    def _xy(self, latlon: Array) -> Array:
        transformer, is_geographic = _operation(self.crs, self.near)
        x, y = transformer.transform(latlon[..., 1], latlon[..., 0], direction="INVERSE")
        if is_geographic:
            # Whole turns that PROJ took away.
            x = x + 360 * np.round((latlon[..., 1] - x) / 360)
        return np.stack([x, y], -1)

    @staticmethod
    def _beside(latlon: Array, found: Array) -> Array:
        """`found` with its longitudes in the turn of those of `latlon`."""
        longitude = latlon[..., 1] + wrapped_deg(found[..., 1] - latlon[..., 1])
        return np.stack([found[..., 0], longitude], -1)


def plane_of(
    crs: str | None, near: tuple[float, float] = (0.0, 0.0), origin: tuple[float, float] | None = None
) -> Plane:
    """The plane that a coordinate reference system means: degrees for None, `local` metres around `origin`.

    Args:
        crs: None, `local`, or what pyproj understands (`EPSG:4326` and `EPSG:3857` need no pyproj).
        near: x, y of a place in the map.
        origin: latitude, longitude of x = y = 0 for `local`.

    Raises: UserError without a pyproj that is needed; ValueError if the system or the origin cannot be used.
    """
    name = "EPSG:4326" if crs is None else crs.strip().upper()
    if name == "LOCAL":
        if origin is None:
            raise ValueError("local metres need the latitude and longitude of their origin")
        return LocalMetres(origin)
    if name in _DEGREES:
        return Degrees()
    return WebMercator() if name in _WEB_MERCATOR else Projected(str(crs), near)


@lru_cache(maxsize=64)
def _operation(crs: str, near: tuple[float, float]) -> tuple[Any, bool]:
    """(pyproj's transformer from `crs` to WGS-84, both longitude first; whether `crs` is in degrees)."""
    try:
        import pyproj
        from pyproj.aoi import AreaOfInterest
        from pyproj.exceptions import ProjError
        from pyproj.transformer import TransformerGroup
    except ImportError:
        raise UserError(f"a map in {_short(crs)} needs pyproj: pip install 'diffnav[geo]'") from None
    try:
        system = pyproj.CRS.from_user_input(crs)
        rough = pyproj.Transformer.from_crs(system, "EPSG:4326", always_xy=True).transform(*near)
        area: Any = None
        if np.isfinite(rough).all() and abs(rough[1]) <= 90:
            # An area must not leave [-180, 180].
            west = min(max(float(wrapped_deg(rough[0])), -180 + _AREA_DEG), 180 - _AREA_DEG)
            area = AreaOfInterest(west - _AREA_DEG, rough[1] - _AREA_DEG, west + _AREA_DEG, rough[1] + _AREA_DEG)
        with warnings.catch_warnings():
            # Of grids that are not installed: what is left is good to a few metres.
            warnings.simplefilter("ignore")
            group = TransformerGroup(system, "EPSG:4326", always_xy=True, area_of_interest=area)
        if not group.transformers:
            raise ProjError("no transformation to WGS-84")
    except ProjError as error:
        reason = str(error).split("(Internal")[0].strip(" .:")
        raise ValueError(f"its coordinate system {_short(crs)} cannot be used ({reason})") from None
    return group.transformers[0], bool(system.is_geographic)


def _short(crs: str) -> str:
    """A system's name where its description is a page long."""
    text = " ".join(crs.split())
    named = text.split('"')
    return named[1] if len(text) > 40 and len(named) > 1 else text[:40]
