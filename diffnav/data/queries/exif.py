"""What a photo's own tags tell of it: EXIF, and the XMP of DJI's cameras."""

import math
import re
import warnings
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

from PIL import Image

from diffnav.data.queries.facts import Truth, parsed_time
from diffnav.geometry.geodesy import wrapped_deg

_EXIF, _GPS = 0x8769, 0x8825
_LATITUDE_REF, _LATITUDE, _LONGITUDE_REF, _LONGITUDE, _STATUS, _DIRECTION = 1, 2, 3, 4, 9, 17
_DATE_TIME, _ORIGINAL, _OFFSET, _SUBSECONDS, _FOCAL_35MM = 306, 36867, 36881, 37521, 41989
# The picture's longer side is taken for the film's 36 mm; makers differ by some 5 % in what they call equivalent.
_FILM_MM = 36.0


def exif_truth(path: Path) -> tuple[Truth, str | None]:
    """(what a photo's tags say, why they hold no place: None if they do).

    The place is that of EXIF GPS; the heading GPSImgDirection, true or magnetic, else DJI's gimbal yaw; the height
    DJI's relative altitude: EXIF's altitude counts from the sea and is left out. Never raises: a file that cannot be
    read has no tags.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(path) as picture:
                exif, longer, xmp = picture.getexif(), max(picture.size), picture.info.get("xmp", b"")
                gps, camera = dict(exif.get_ifd(_GPS)), {**exif, **exif.get_ifd(_EXIF)}
    except Exception:  # damaged tags raise anything; what matters is that they say nothing
        return Truth(), "tags cannot be read"
    place, reason = _place(gps)
    focal = _number(camera.get(_FOCAL_35MM))
    dji = _dji(xmp if isinstance(xmp, bytes) else str(xmp).encode())
    heading = _number(gps.get(_DIRECTION))
    heading = dji.get("GimbalYawDegree") if heading is None else heading
    return Truth(
        latitude=place[0] if place else None,
        longitude=place[1] if place else None,
        height_m=dji.get("RelativeAltitude"),
        heading_deg=None if heading is None else heading % 360,
        time=_time(camera),
        pixel_angle_rad=_FILM_MM / focal / longer if focal else None,
    ), reason


def _place(gps: Mapping[int, Any]) -> tuple[tuple[float, float] | None, str | None]:
    """(latitude, longitude in degrees, None) or (None, why not)."""
    if _LATITUDE not in gps and _LONGITUDE not in gps:
        return None, "EXIF holds no GPS position"
    if _text(gps.get(_STATUS)).upper() == "V":
        return None, "EXIF GPS was recorded without a fix"
    place = []
    for name, tag, ref, signs in (
        ("latitude", _LATITUDE, _LATITUDE_REF, {"N": 1, "S": -1}),
        ("longitude", _LONGITUDE, _LONGITUDE_REF, {"E": 1, "W": -1}),
    ):
        degrees = _degrees(gps.get(tag))
        sign = signs.get(_text(gps.get(ref)).upper()[:1])
        if degrees is None:
            return None, f"EXIF GPS lacks a readable {name}"
        if sign is None:
            return None, f"EXIF GPS does not say whether its {name} is {' or '.join(signs)}"
        place.append(sign * degrees)
    if abs(place[0]) > 90 or abs(place[1]) > 180:
        return None, f"EXIF GPS is no place on the earth ({place[0]:g}, {place[1]:g})"
    if place == [0, 0]:
        # What cameras write that have no fix yet.
        return None, "EXIF GPS is 0, 0"
    return (place[0], float(wrapped_deg(place[1]))), None


def _degrees(value: Any) -> float | None:
    """Degrees, minutes and seconds, or the first one or two of them, as degrees; None if one is no number."""
    parts = [_number(part) for part in (value if isinstance(value, tuple | list) else [value])]
    if not 1 <= len(parts) <= 3:
        return None
    total = 0.0
    for part, unit in zip(parts, (1, 60, 3600), strict=False):
        if part is None or part < 0:
            return None
        total += part / unit
    return total


def _number(value: Any) -> float | None:
    """A finite number of a rational or plain one; None for zero denominators and what is no number."""
    try:
        number = float(value)
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return number if math.isfinite(number) else None


def _text(value: Any) -> str:
    text = value.decode("latin-1") if isinstance(value, bytes) else str(value or "")
    return text.strip(" \0")


def _time(camera: Mapping[int, Any]) -> datetime | None:
    """When the picture was taken, with fractions of a second and zone where they are recorded."""
    time = parsed_time(_text(camera.get(_ORIGINAL)) or _text(camera.get(_DATE_TIME)))
    if time is None:
        return None
    digits = _text(camera.get(_SUBSECONDS))
    if digits.isdigit():
        time = time.replace(microsecond=int(digits[:6].ljust(6, "0")))
    zone = parsed_time(f"2000-01-01T00:00:00{_text(camera.get(_OFFSET))}")
    return time.replace(tzinfo=zone.tzinfo) if zone else time


def _dji(xmp: bytes) -> dict[str, float]:
    """The gimbal's yaw in degrees and the height above the take-off in metres, those that are there."""
    found = {}
    for name in ("GimbalYawDegree", "RelativeAltitude"):
        # An attribute or an element.
        match = re.search(rf'drone-dji:{name}\s*(?:=\s*"|>)\s*([+-]?[0-9.]+)'.encode(), xmp)
        number = _number(match[1]) if match else None
        if number is not None:
            found[name] = number
    return found
