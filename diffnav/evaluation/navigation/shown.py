"""The answers of one row as files for maps and receivers: HTML, GeoJSON, GPX, NMEA."""

from collections.abc import Sequence
from pathlib import Path

from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.queries.query import Query
from diffnav.evaluation.navigation.records import NavigationRecord
from diffnav.navigation.exports.geojson import write_geojson
from diffnav.navigation.exports.gpx import write_gpx
from diffnav.navigation.exports.html_map import write_html_map
from diffnav.navigation.exports.nmea import write_nmea


def shown_records(records: Sequence[NavigationRecord]) -> list[NavigationRecord]:
    """The answers of the row that is exported: the last method, its first search, in its darkest condition."""
    method = records[-1].method
    own = [record for record in records if record.method == method]
    search = own[0].matcher, own[0].mode
    own = [record for record in own if (record.matcher, record.mode) == search]
    # Delivered pictures are each of one condition; where each query was asked in both, the dark answers are shown.
    twice = len({record.name for record in own}) < len(own)
    return [record for record in own if record.condition == "dark"] if twice else own


def write_exports(
    out: Path, records: Sequence[NavigationRecord], queries: Sequence[Query], maps: Sequence[GeoMap]
) -> list[Path]:
    """Write map.html, fixes.geojson, fixes.gpx and fixes.nmea of the shown row. Raises: UserError; ImageError."""
    fixes = [record.fix for record in shown_records(records)]
    asked = {fix.query for fix in fixes}
    truths = {query.name: query.truth for query in queries if query.truth is not None and query.name in asked}
    paths = [out / name for name in ("map.html", "fixes.geojson", "fixes.gpx", "fixes.nmea")]
    write_html_map(paths[0], fixes, maps, truths)
    write_geojson(paths[1], fixes, truths)
    write_gpx(paths[2], fixes)
    write_nmea(paths[3], fixes)
    return paths
