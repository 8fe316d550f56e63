"""Fixes of a made flight, and where its track expects the next."""

import math
from datetime import datetime, timedelta

from made_maps import DEGREE_M, ORIGIN, Place, metres_from

from diffnav.navigation.fix import Fix
from diffnav.navigation.track import Track

START = datetime(2024, 5, 1, 12, 0, 0)


def place_at(east: float, north: float, origin: Place = ORIGIN) -> Place:
    latitude = origin[0] + north / DEGREE_M
    longitude = origin[1] + east / (DEGREE_M * math.cos(math.radians((origin[0] + latitude) / 2)))
    return latitude, (longitude + 180) % 360 - 180


def fix_at(
    east: float, north: float, seconds: float | None = None, sigma_m: float = 1.0, origin: Place = ORIGIN
) -> Fix:
    latitude, longitude = place_at(east, north, origin)
    return Fix(
        "photo", "fix", latitude=latitude, longitude=longitude, sigma_m=sigma_m, heading_deg=10.0, inliers=30,
        matches=50, map="map", tile="map/0,0", time=None if seconds is None else START + timedelta(seconds=seconds),
    )  # fmt: skip


def lost(seconds: float | None = None) -> Fix:
    time = None if seconds is None else START + timedelta(seconds=seconds)
    return Fix("photo", "no_fix", ("too dark",), matches=3, time=time)


def flown(track: Track, steps: int, speed: float = 10.0, first: int = 0) -> list[Fix]:
    """A straight flight to the east, a picture a second."""
    return [track.update(fix_at(speed * k, 0, k)) for k in range(first, first + steps)]


def expected_at(track: Track, seconds: float | None) -> tuple[Place, float]:
    """East and north of the expected place, and its radius."""
    prior = track.expected(None if seconds is None else START + timedelta(seconds=seconds))
    assert prior.place is not None
    assert prior.radius_m is not None
    return metres_from(ORIGIN, prior.place), prior.radius_m
