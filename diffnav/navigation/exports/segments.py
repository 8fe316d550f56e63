"""Where a track is interrupted."""

from collections.abc import Sequence

from diffnav.navigation.exports.fields import place_of
from diffnav.navigation.fix import Fix

# One lost picture is bridged by a straight line; after more the track begins anew.
LONGEST_GAP = 1


def track_segments(fixes: Sequence[Fix], longest_gap: int = LONGEST_GAP) -> list[list[Fix]]:
    """The fixes that have a place, in order; a new list where a flight begins, or more than `longest_gap` are missing.

    Missing are pictures in a row without a place. Those of no flight stand alone.
    """
    segments: list[list[Fix]] = []
    missing = 0
    for fix in fixes:
        if place_of(fix) is None:
            missing += 1
            continue
        follows = bool(segments) and bool(fix.flight) and fix.flight == segments[-1][-1].flight
        if not follows or missing > longest_gap:
            segments.append([])
        segments[-1].append(fix)
        missing = 0
    return segments
