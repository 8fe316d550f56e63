"""What is wrong with a georeference: a map that is described wrongly gives wrong places, and nothing else shows it."""

from typing import TYPE_CHECKING

import numpy as np

from diffnav.geometry.geodesy import Array, wrapped_deg

if TYPE_CHECKING:
    from diffnav.geometry.georeference.planar import PlanarGeoreference

# Degrees from the equator at which a map ends: near the poles neither pixels nor differences of longitude mean much.
_HIGHEST_DEG = 89.0
_CELLS = 8
_ROUND_TRIP_PX = 1e-3


class ImpossibleBoundsError(ValueError):
    """Numbers that are called degrees and cannot be."""


def require_sound(georeference: "PlanarGeoreference") -> None:
    """Raises ImpossibleBoundsError or ValueError, in half a sentence without the map's name, for a map that

    has no size; lies nowhere on the earth; reaches within 1 degree of a pole or more than once around the earth; is
    mirrored, folded, or without area; or whose plane does not lead back to its pixels.
    """
    height, width = georeference.size
    if height < 1 or width < 1:
        raise ValueError(f"its size is {width} x {height} pixels; it must be 1 x 1 or more")
    edge = _edge_grid(height, width)
    latlon = georeference.unwrapped_latlon(edge)
    _require_places(latlon)
    _require_away_from_poles(georeference, latlon)
    _require_orientation(latlon)
    # Between the outer pixels' centres: the edges of a map of the whole earth are one line.
    inner = np.clip(edge, 0, [width - 1, height - 1])
    with np.errstate(invalid="ignore"):
        strayed = np.abs(georeference.pixels(georeference.latlon(inner)) - inner)
    if not (strayed < _ROUND_TRIP_PX).all():
        raise ValueError("it reaches beyond the area of its coordinate system; cut the map or give another system")


def _edge_grid(height: int, width: int) -> Array:
    """(9, 9, 2) points from the outer edge of the outer pixels to the opposite one."""
    share = np.linspace(0, 1, _CELLS + 1)
    x, y = np.meshgrid(share * width - 0.5, share * height - 0.5)
    return np.stack([x, y], -1)


def _require_places(latlon: Array) -> None:
    if not np.isfinite(latlon).all():
        raise ImpossibleBoundsError("its bounds lie outside of what its coordinate system covers")
    (south, west), (north, east) = latlon.min((0, 1)), latlon.max((0, 1))
    if south < -90 or north > 90 or west < -540 or east > 540:
        raise ImpossibleBoundsError(
            f"its bounds, latitude {south:.4f} to {north:.4f} and longitude {west:.4f} to {east:.4f}, are no degrees"
        )
    if east - west > 360 + 1e-9:
        raise ImpossibleBoundsError(f"it spans {east - west:.1f} degrees of longitude, more than once around the earth")


def _require_away_from_poles(georeference: "PlanarGeoreference", latlon: Array) -> None:
    height, width = georeference.size
    highest = latlon[..., 0].flat[np.abs(latlon[..., 0]).argmax()]
    if abs(highest) > _HIGHEST_DEG:
        raise ValueError(f"it reaches latitude {highest:.2f}, within 1 degree of a pole; cut it off before")
    with np.errstate(invalid="ignore", over="ignore"):
        poles = georeference.pixels([[90.0, 0.0], [-90.0, 0.0]])
    # Of a map around a pole the edges alone would not tell.
    if ((poles > -0.5) & (poles < [width - 0.5, height - 0.5])).all(-1).any():
        raise ValueError("it shows a pole, where longitudes meet; cut it into maps beside the pole")


def _require_orientation(latlon: Array) -> None:
    """By the signed areas of the cells of a grid (9, 9, 2): each has north on the left of east, seen from above."""
    one, other = latlon[1:, 1:] - latlon[:-1, :-1], latlon[1:, :-1] - latlon[:-1, 1:]
    east, across = wrapped_deg(one[..., 1]), wrapped_deg(other[..., 1])
    area = east * other[..., 0] - one[..., 0] * across
    if (area < 0).all():
        return
    if (area > 0).all():
        raise ValueError(
            "it is mirrored, as if seen from below: exchange its north and south, or latitudes and longitudes; in a "
            "file of six numbers the y size of a map with north at its top is negative"
        )
    if (area == 0).all():
        raise ValueError("it has no area: its corners or pixel sizes lie on one line or in one point")
    raise ValueError("it is folded: two of its corners are exchanged")
