"""Lines and rings cut where they cross longitude 180 degrees, as RFC 7946, section 3.1.9, asks."""

import math
from collections.abc import Sequence

from diffnav.geometry.geodesy import wrapped_deg

Position = tuple[float, float]


def unwrapped_deg(longitude: float, reference: float) -> float:
    """The same meridian within 180 degrees of `reference`; one that lies there already is not touched."""
    apart = longitude - reference
    return longitude if abs(apart) <= 180 else reference + float(wrapped_deg(apart))


def cut_line(places: Sequence[Position]) -> list[list[Position]]:
    """The line through latitudes, longitudes, each leg the shorter way round: lists of (longitude, latitude).

    Both sides of a cut end at latitude's linear value on the antimeridian. Lines without length are left out.
    """
    if len(places) < 2:
        return []
    latitude, longitude = places[0][0], float(wrapped_deg(places[0][1]))
    lines = [[(longitude, latitude)]]
    for next_latitude, next_longitude in places[1:]:
        aim = unwrapped_deg(next_longitude, longitude)
        if abs(aim) > 180:
            edge = math.copysign(180.0, aim)
            crossing = latitude + (next_latitude - latitude) * (edge - longitude) / (aim - longitude)
            lines[-1].append((edge, crossing))
            lines.append([(-edge, crossing)])
            aim -= 2 * edge
        lines[-1].append((aim, next_latitude))
        latitude, longitude = next_latitude, aim
    return [line for line in lines if len(set(line)) > 1]


def cut_ring(places: Sequence[Position]) -> list[list[Position]]:
    """The polygon of latitudes, longitudes in parts within +-180 degrees: closed rings (longitude, latitude).

    Each runs counter-clockwise and ends with its first position, as RFC 7946, section 3.1.6, has it. No ring for fewer
    than three places or no area. The polygon must not hold a pole.
    """
    if len(places) < 3:
        return []
    first = float(wrapped_deg(places[0][1]))
    ring = [(unwrapped_deg(longitude, first), latitude) for latitude, longitude in places]
    parts = []
    for shift in (-360, 0, 360):
        moved = [(longitude + shift, latitude) for longitude, latitude in ring]
        part = _one_side(_one_side(moved, -180.0, 1), 180.0, -1)
        area = _doubled_area(part)
        if area != 0:
            part = part if area > 0 else part[::-1]
            parts.append([*part, part[0]])
    return parts


def _one_side(ring: Sequence[Position], edge: float, sign: int) -> list[Position]:
    """The ring where sign * (longitude - edge) >= 0. Source: Sutherland & Hodgman 1974, one edge."""
    kept: list[Position] = []
    for (x, y), (next_x, next_y) in zip(ring, [*ring[1:], *ring[:1]], strict=True):
        inside, next_inside = sign * (x - edge) >= 0, sign * (next_x - edge) >= 0
        if inside:
            kept.append((x, y))
        if inside != next_inside:
            kept.append((edge, y + (next_y - y) * (edge - x) / (next_x - x)))
    return kept


def _doubled_area(ring: Sequence[Position]) -> float:
    """Twice the signed area, above 0 counter-clockwise; from the first position, so that little is cancelled."""
    if not ring:
        return 0.0
    x0, y0 = ring[0]
    turns = zip(ring, [*ring[1:], *ring[:1]], strict=True)
    return sum((x - x0) * (next_y - y0) - (next_x - x0) * (y - y0) for (x, y), (next_x, next_y) in turns)
