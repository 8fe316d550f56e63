"""What all exports write alike: text without forbidden characters, places where there are some, times in UTC."""

import math
import re
from datetime import UTC, datetime

from diffnav.navigation.fix import Fix

# What XML 1.0 forbids: control characters, halves of surrogate pairs (of file names that are not UTF-8), and two more.
_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def clean(text: str) -> str:
    """The text with U+FFFD for every character that XML forbids."""
    return _FORBIDDEN.sub("\N{REPLACEMENT CHARACTER}", text)


def place_of(fix: Fix) -> tuple[float, float] | None:
    """Latitude and longitude in degrees of a fix or a coasted one; None for `no_fix` and where they are not finite."""
    if fix.status == "no_fix" or fix.place is None or not all(math.isfinite(value) for value in fix.place):
        return None
    return fix.place


def utc(time: datetime) -> datetime:
    """The time in UTC; without a zone it is taken to be UTC already, for nothing tells otherwise."""
    return time.replace(tzinfo=UTC) if time.tzinfo is None else time.astimezone(UTC)
