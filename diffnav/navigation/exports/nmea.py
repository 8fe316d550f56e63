"""Fixes as NMEA 0183 sentences GGA, which autopilots and plotters read."""

import math
from collections.abc import Sequence
from functools import reduce
from pathlib import Path

from diffnav.geometry.geodesy import wrapped_deg
from diffnav.navigation.exports.fields import place_of, utc
from diffnav.navigation.fix import Fix
from diffnav.navigation.text_file import write_text

# The range error of one satellite that receivers multiply with HDOP to get the error of the place, metres.
RANGE_ERROR_M = 5.0
# GGA's quality indicator.
_NO_FIX, _FIX, _ESTIMATED = 0, 1, 6
_LARGEST_HDOP = 99.9


def write_nmea(path: Path, fixes: Sequence[Fix]) -> None:
    """Write one GGA sentence a picture, lines ended by CR LF. Raises: UserError if the file cannot be written."""
    write_text(Path(path), "".join(f"{gga(fix)}\r\n" for fix in fixes))


def gga(fix: Fix) -> str:
    """`$GPGGA,time,latitude,N|S,longitude,E|W,quality,satellites,HDOP,altitude,M,geoid,M,age,station*checksum`.

    Quality: 1 for a fix, 6 (estimated) for a coasted one, 0 without a place, whose fields are then empty. Places are
    written to a millionth of a minute, 2 mm. Satellites are 00, as none is used; altitude, geoid, age and station are
    empty. Time: UTC, empty if unknown. Source: NMEA 0183, GGA.
    """
    place = place_of(fix)
    time = f"{utc(fix.time):%H%M%S}.{utc(fix.time).microsecond // 10_000:02d}" if fix.time else ""
    quality, where, dilution = _NO_FIX, ["", "", "", ""], ""
    if place is not None:
        quality = _FIX if fix.status == "fix" else _ESTIMATED
        latitude, longitude = place[0], float(wrapped_deg(place[1]))
        where = [_minutes(latitude, 2), "NS"[latitude < 0], _minutes(longitude, 3), "EW"[longitude < 0]]
        dilution = "" if hdop(fix) is None else f"{hdop(fix):.1f}"
    body = ",".join(["GPGGA", time, *where, str(quality), "00", dilution, "", "M", "", "M", "", ""])
    return f"${body}*{checksum(body):02X}"


def hdop(fix: Fix) -> float | None:
    """Horizontal dilution of precision: sqrt(2) sigma_m / 5 m, at most 99.9; None without a sigma.

    A receiver's horizontal error, the root mean square of both axes together, is HDOP times the range error.
    """
    if fix.sigma_m is None or not math.isfinite(fix.sigma_m):
        return None
    return min(math.sqrt(2) * fix.sigma_m / RANGE_ERROR_M, _LARGEST_HDOP)


def checksum(body: str) -> int:
    """The exclusive or of all characters between $ and *."""
    return reduce(lambda total, character: total ^ ord(character), body, 0)


def _minutes(degrees: float, digits: int) -> str:
    """Degrees and minutes, ddmm.mmmmmm, of the absolute value; rounded before it is taken apart: never 60 minutes."""
    whole, millionths = divmod(round(abs(degrees) * 60_000_000), 60_000_000)
    minutes, rest = divmod(millionths, 1_000_000)
    return f"{whole:0{digits}d}{minutes:02d}.{rest:06d}"
