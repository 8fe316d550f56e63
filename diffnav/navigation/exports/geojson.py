"""Fixes as GeoJSON (RFC 7946) for geographic information systems; longitude comes first in it."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from diffnav.geometry.geodesy import haversine_m, wrapped_deg
from diffnav.navigation.exports.antimeridian import Position, cut_line, cut_ring
from diffnav.navigation.exports.fields import clean, place_of, utc
from diffnav.navigation.exports.segments import track_segments
from diffnav.navigation.fix import Fix
from diffnav.navigation.text_file import write_text

Json = dict[str, Any]
# A millimetre on the ground.
_DECIMALS = 8


def write_geojson(path: Path, fixes: Sequence[Fix], truths: Mapping[str, tuple[float, float]] | None = None) -> None:
    """Write one FeatureCollection, each feature's `kind` among its properties.

    kind `fix`: a point for each picture, with all that is known of it; geometry null where it has no place.
    `footprint`: what the picture shows, a polygon. `track`: a line for each stretch of `segments.track_segments`.
    `truth`: a point for each of the `truths`, latitudes and longitudes by query; their fixes have an `error_m`.
    Lines and polygons are cut at the antimeridian. Raises: UserError if the file cannot be written.
    """
    truths = truths or {}
    features = [_fix_feature(fix, truths.get(fix.query)) for fix in fixes]
    features += [feature for fix in fixes if (feature := _footprint_feature(fix))]
    segments = track_segments(fixes)
    features += [feature for number, own in enumerate(segments) if (feature := _track_feature(number, own))]
    features += [_truth_feature(query, place) for query, place in truths.items()]
    collection = {"type": "FeatureCollection", "features": features}
    write_text(Path(path), json.dumps(_plain(collection), ensure_ascii=False, allow_nan=False, indent=1) + "\n")


def _fix_feature(fix: Fix, truth: tuple[float, float] | None) -> Json:
    place = place_of(fix)
    properties = {
        "kind": "fix",
        "query": fix.query,
        "status": fix.status,
        "reasons": list(fix.reasons),
        "heading_deg": fix.heading_deg,
        "ground_sample_distance_m": fix.ground_sample_distance_m,
        "sigma_m": fix.sigma_m,
        "map": fix.map,
        "tile": fix.tile,
        "inliers": fix.inliers,
        "matches": fix.matches,
        "enhanced": fix.enhanced,
        "definition": fix.definition,
        "milliseconds": dict(fix.milliseconds),
        "time": utc(fix.time).isoformat() if fix.time else None,
    }
    if truth is not None:
        properties["error_m"] = None if place is None else float(haversine_m(place, truth))
    return _feature(None if place is None else _point(place), properties)


def _footprint_feature(fix: Fix) -> Json | None:
    rings = cut_ring(fix.footprint) if place_of(fix) else []
    if not rings:
        return None
    polygons = [[_rounded(ring)] for ring in rings]
    return _feature(_one_or_many("Polygon", polygons), {"kind": "footprint", "query": fix.query, "status": fix.status})


def _track_feature(number: int, segment: Sequence[Fix]) -> Json | None:
    lines = cut_line([place for fix in segment if (place := place_of(fix))])
    if not lines:
        return None
    properties = {"kind": "track", "segment": number, "first": segment[0].query, "last": segment[-1].query}
    return _feature(_one_or_many("LineString", [_rounded(line) for line in lines]), properties)


def _truth_feature(query: str, place: tuple[float, float]) -> Json:
    return _feature(_point(place), {"kind": "truth", "query": query})


def _feature(geometry: Json | None, properties: Json) -> Json:
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def _point(place: tuple[float, float]) -> Json:
    return {"type": "Point", "coordinates": _rounded([(float(wrapped_deg(place[1])), place[0])])[0]}


def _one_or_many(kind: str, parts: list) -> Json:
    if len(parts) == 1:
        return {"type": kind, "coordinates": parts[0]}
    return {"type": f"Multi{kind}", "coordinates": parts}


def _rounded(positions: Sequence[Position]) -> list[list[float]]:
    return [[round(value, _DECIMALS) for value in position] for position in positions]


def _plain(value: Any) -> Any:
    """The value as JSON can hold it: text that is valid Unicode, null for numbers that are not finite."""
    if isinstance(value, str):
        return clean(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {clean(str(key)): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value
