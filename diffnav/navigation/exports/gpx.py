"""The track as GPX 1.1, which every mapping program opens."""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

from diffnav.geometry.geodesy import wrapped_deg
from diffnav.navigation.exports.fields import clean, place_of, utc
from diffnav.navigation.exports.nmea import hdop
from diffnav.navigation.exports.segments import track_segments
from diffnav.navigation.fix import Fix
from diffnav.navigation.text_file import write_text

_NAMESPACE = "http://www.topografix.com/GPX/1/1"


def write_gpx(path: Path, fixes: Sequence[Fix], name: str = "diffnav") -> None:
    """Write one track called `name`; a segment is a stretch of `segments.track_segments`.

    A point's `name` is its query, `src` the map, `type` its status, `fix` 2d, or none where it is coasted, `hdop`
    that of `nmea.hdop`. Pictures without a place leave no point.
    Raises: UserError if the file cannot be written.
    """
    root = ET.Element("gpx", {"version": "1.1", "creator": "diffnav", "xmlns": _NAMESPACE})
    track = ET.SubElement(root, "trk")
    ET.SubElement(track, "name").text = clean(name)
    for segment in track_segments(fixes):
        element = ET.SubElement(track, "trkseg")
        for fix in segment:
            _add_point(element, fix)
    ET.indent(root)
    write_text(Path(path), f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n')


def _add_point(segment: ET.Element, fix: Fix) -> None:
    """The schema fixes the order of a point's children."""
    place, dilution = place_of(fix), hdop(fix)
    assert place is not None
    latitude, longitude = place
    point = ET.SubElement(segment, "trkpt", {"lat": f"{latitude:.8f}", "lon": _longitude(longitude)})
    children = {
        "time": f"{utc(fix.time).replace(tzinfo=None).isoformat(timespec='milliseconds')}Z" if fix.time else None,
        "name": fix.query,
        "src": fix.map,
        "type": fix.status,
        "fix": "2d" if fix.status == "fix" else "none",
        "hdop": None if dilution is None else f"{dilution:.2f}",
    }
    for tag, text in children.items():
        if text is not None:
            ET.SubElement(point, tag).text = clean(text)


def _longitude(degrees: float) -> str:
    """Wrapped after rounding: the schema allows -180, but not 180."""
    return f"{float(wrapped_deg(round(float(wrapped_deg(degrees)), 8))):.8f}"
