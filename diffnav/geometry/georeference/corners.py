"""Georeferences by four corners or by bounds: linear between the corners (PAPER.md, D21)."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from diffnav.geometry.geodesy import Array, wrapped_deg
from diffnav.geometry.georeference.planar import PlanarGeoreference
from diffnav.geometry.georeference.planes import Degrees, Plane
from diffnav.geometry.georeference.soundness import ImpossibleBoundsError

_CORNERS = ("top left", "top right", "bottom right", "bottom left")
# Of the product of two sides' lengths: less is rounding.
_NO_AREA = 1e-9


class _Quadrilateral(NamedTuple):
    """Plane points start + across u + down v + bend u v, each (2,), for u, v in [0, 1] from the top left corner."""

    start: Array
    across: Array
    down: Array
    bend: Array


@dataclass(frozen=True)
class CornerGeoreference(PlanarGeoreference):
    """Pixels lie bilinearly between four corners, which are the outer corners of the outermost pixels.

    size: (h, w). plane: in which the pixels are linear. corners: latitude, longitude of top left, top right, bottom
    right, bottom left; longitudes in one turn.
    Raises: ImpossibleBoundsError, ValueError (`soundness`).
    """

    corners: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        _require_places(self.corners)
        _require_order(self._quadrilateral)
        super().__post_init__()

    def to_plane(self, points: Array) -> Array:
        height, width = self.size
        start, across, down, bend = self._quadrilateral
        u, v = (points[..., :1] + 0.5) / width, (points[..., 1:] + 0.5) / height
        return start + across * u + down * v + bend * (u * v)

    def from_plane(self, xy: Array) -> Array:
        """By the quadratic that v solves; not finite where no point of the bilinear law lies, far from the map."""
        start, across, down, bend = self._quadrilateral
        away = xy - start
        square = -_cross(down, bend)
        linear = _cross(away, bend) - _cross(down, across)
        constant = _cross(away, across)
        with np.errstate(invalid="ignore", divide="ignore"):
            # Its derivative is the area element, negative all over a map (y runs down): that selects the root.
            root = np.sqrt(linear**2 - 4 * square * constant)
            v = np.where(linear <= 0, 2 * constant / (root - linear), -(linear + root) / (2 * square))
            side = across + bend * v[..., None]
            u = ((away - down * v[..., None]) * side).sum(-1) / (side**2).sum(-1)
        height, width = self.size
        return np.stack([u * width - 0.5, v * height - 0.5], -1)

    @cached_property
    def _quadrilateral(self) -> _Quadrilateral:
        top_left, top_right, bottom_right, bottom_left = self.plane.xy(np.array(self.corners, np.float64))
        across, down = top_right - top_left, bottom_left - top_left
        return _Quadrilateral(top_left, across, down, bottom_right - bottom_left - across)


def corners_georeference(
    size: tuple[int, int], corners: Sequence[Sequence[float]], plane: Plane | None = None
) -> CornerGeoreference:
    """The georeference of a picture of `size` (h, w) whose four outer corners are known.

    Args:
        corners: latitude, longitude in degrees of top left, top right, bottom right, bottom left; they may lie on
            both sides of the antimeridian.
        plane: in which pixels lie evenly, degrees for None.

    Raises: ImpossibleBoundsError, ValueError (`soundness`), in half a sentence without the map's name.
    """
    if len(corners) != 4 or any(len(corner) != 2 for corner in corners):
        raise ValueError(f"its corners must be four pairs [latitude, longitude] ({', '.join(_CORNERS)})")
    first = float(corners[0][1])
    placed = [(float(latitude), first + float(wrapped_deg(longitude - first))) for latitude, longitude in corners]
    return CornerGeoreference(size, plane or Degrees(), tuple(placed))


def bounds_georeference(
    size: tuple[int, int], north: float, west: float, south: float, east: float, plane: Plane | None = None
) -> CornerGeoreference:
    """The georeference of a north-up picture of `size` (h, w) between two parallels and two meridians, in degrees.

    The bounds are those of the outer edge of its outer pixels. A map over the antimeridian has east below west.
    plane: in which pixels lie evenly, degrees for None.
    Raises: ImpossibleBoundsError, ValueError (`soundness`), in half a sentence without the map's name.
    """
    upside_down = north < south
    # Of two meridians those less than half a turn apart: beyond that west and east are rather exchanged.
    turned = west > east and (east - west) % 360 > 180
    if upside_down and turned:
        raise ValueError(f"north {north} lies below south {south} and west {west} beyond east {east}: exchange them")
    if upside_down:
        raise ValueError(f"north {north} lies below south {south}: exchange them, or latitudes and longitudes")
    if turned:
        raise ValueError(f"west {west} lies beyond east {east}: exchange them, or latitudes and longitudes")
    east = east + 360 if east < west else east
    return CornerGeoreference(size, plane or Degrees(), ((north, west), (north, east), (south, east), (south, west)))


def _require_places(corners: tuple[tuple[float, float], ...]) -> None:
    for name, (latitude, longitude) in zip(_CORNERS, corners, strict=True):
        if not np.isfinite([latitude, longitude]).all():
            raise ValueError(f"its {name} corner has no finite latitude and longitude")
        if abs(latitude) > 90:
            raise ImpossibleBoundsError(
                f"the latitude {latitude:g} of its {name} corner lies beyond 90 degrees; latitude stands first"
            )


def _require_order(quadrilateral: _Quadrilateral) -> None:
    """Raises ValueError unless the corners run clockwise around a convex area, as seen from above."""
    _, across, down, bend = quadrilateral
    sides = ((across, down), (across, down + bend), (across + bend, down + bend), (across + bend, down))
    # Sines of the angles at the corners; y runs down the picture and up the plane, so they are negative.
    scale = max(np.linalg.norm(one) * np.linalg.norm(other) for one, other in sides)
    turns = np.array([_cross(one, other) for one, other in sides])
    if scale == 0 or (np.abs(turns) <= _NO_AREA * scale).any():
        raise ValueError("three of its corners lie on one line or two in one point")
    if (turns > 0).all():
        raise ValueError(
            f"its corners run anticlockwise, so that it would be mirrored: the order is {', '.join(_CORNERS)}, "
            "each latitude, longitude"
        )
    if not (turns < 0).all():
        raise ValueError(f"its sides cross: the corners' order is {', '.join(_CORNERS)}")


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
