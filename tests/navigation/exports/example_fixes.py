"""Fixes made by hand: a flight over the antimeridian with lost and coasted pictures and awkward names."""

from datetime import UTC, datetime, timedelta, timezone

from diffnav.navigation.fix import Fix

NASTY = "a<b>&\"'`${1}</script>\x07\udc80 größe.jpg"


def fix(query="a", latitude=10.0, longitude=20.0, status="fix", **known):
    return Fix(query=query, status=status, latitude=latitude, longitude=longitude, **({"flight": "one"} | known))


def lost(query="lost", **known):
    return Fix(query=query, status="no_fix", reasons=("3 inliers, 8 are needed",), **({"flight": "one"} | known))


def flight():
    """Eight pictures: two fixes, one lost, one fix beyond the antimeridian, two lost, a coasted one, a fix."""
    start = datetime(2024, 5, 6, 23, 59, 59, 450_000, tzinfo=UTC)
    footprint = ((-17.9, 179.98), (-17.9, -179.98), (-17.92, -179.98), (-17.92, 179.98))
    east = start.astimezone(timezone(timedelta(hours=5, minutes=30)))
    return [
        fix("1", -17.90, 179.97, sigma_m=2.0, time=start, inliers=40, matches=90, map="Fiji", tile="3"),
        fix("2", -17.905, 179.985, sigma_m=3.5, footprint=footprint, time=east, milliseconds={"match": 12.5}),
        lost("3"),
        fix(NASTY, -17.91, -179.985, sigma_m=None, map="a&b", footprint=footprint[::-1]),
        lost("5"),
        lost("6", time=start),
        fix("7", -17.92, -179.96, status="coasted", sigma_m=25.0, time=start.replace(tzinfo=None)),
        fix("8", -17.93, -179.95, enhanced=True, definition=3.2, heading_deg=270.0),
    ]
