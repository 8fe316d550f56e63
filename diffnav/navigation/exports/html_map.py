"""Fixes on their maps as one HTML page for a browser; it opens without a network."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path

import folium

from diffnav.data.maps.geo_map import GeoMap
from diffnav.navigation.exports.antimeridian import unwrapped_deg
from diffnav.navigation.exports.fields import clean, place_of
from diffnav.navigation.exports.leaflet_page import Panel, Popup, empty_map, page_text
from diffnav.navigation.exports.legend import COLOURS, legend_html
from diffnav.navigation.exports.overlay import Overlay, map_overlay
from diffnav.navigation.exports.popups import fix_html
from diffnav.navigation.exports.segments import track_segments
from diffnav.navigation.fix import Fix
from diffnav.navigation.text_file import write_text

Truths = Mapping[str, tuple[float, float]]
Bounds = tuple[tuple[float, float], tuple[float, float]]
_SIDE_PX = 2000
# Of all maps together: a page of many maps shows each in less detail, and still opens.
_PIXELS = 24_000_000
# Where all maps would together be so much larger than the first, the page opens on the first alone.
_SPREAD = 10


def write_html_map(
    path: Path, fixes: Sequence[Fix], maps: Sequence[GeoMap], truths: Truths | None = None, title: str = "Fixes"
) -> None:
    """Write a page with the maps' pictures, fixes, footprints, circles of one sigma, the track and the errors.

    Clicking a fix or a truth tells what is known of it; layers can be switched. Maps come at most 2000 px a side,
    smaller where there are many. truths: latitude and longitude in degrees by query.
    Raises: ImageError if a map cannot be read; UserError if the file cannot be written.
    """
    truths = truths or {}
    side_px = min(_SIDE_PX, max(200, math.isqrt(_PIXELS // max(1, len(maps)))))
    overlays: list[Overlay] = []
    for geo_map in maps:
        overlays.append(map_overlay(geo_map, side_px, overlays[0].west if overlays else None))
    places = [place for fix in fixes if (place := place_of(fix))] + list(truths.values())
    meridian = overlays[0].west if overlays else places[0][1] if places else 0.0
    page = empty_map()
    for geo_map, overlay in zip(maps, overlays, strict=True):
        picture = folium.raster_layers.ImageOverlay(
            overlay.uri, _corners(overlay), name=_label(f"map {geo_map.name}"), pixelated=False
        )
        picture.add_to(page)
    for name, elements in _layers(fixes, truths, meridian).items():
        group = folium.FeatureGroup(name=_label(name))
        for element in elements:
            element.add_to(group)
        if elements:
            group.add_to(page)
    folium.LayerControl(collapsed=len(maps) > 8).add_to(page)
    view = _view(overlays, [_here(place, meridian) for place in places])
    views = {geo_map.name: _corners(overlay) for geo_map, overlay in zip(maps, overlays, strict=True)}
    Panel(legend_html(fixes, truths, list(views)), _view_script(view, list(views.values()))).add_to(page)
    write_text(Path(path), clean(page_text(page, clean(title))))


def _layers(fixes: Sequence[Fix], truths: Truths, meridian: float) -> dict[str, list[folium.map.Marker]]:
    """Elements by layer, those drawn first first."""
    layers: dict[str, list] = {name: [] for name in ("footprints", "one sigma", "track", "errors", "truth", "fixes")}
    footprints: dict[str, list] = {}
    errors = []
    for segment in track_segments(fixes):
        track = [_here(place, meridian) for fix in segment if (place := place_of(fix))]
        if len(track) > 1:
            layers["track"].append(folium.PolyLine(_continuous(track), color=COLOURS["fix"], weight=2, opacity=0.7))
    for fix in fixes:
        place, truth = place_of(fix), truths.get(fix.query)
        text = fix_html(fix, truth)
        if truth is not None:
            layers["truth"].append(_dot(_here(truth, meridian), "truth", text))
        if place is None:
            continue
        here = _here(place, meridian)
        layers["fixes"].append(_dot(here, fix.status, text))
        if len(fix.footprint) > 2:
            closed = [*fix.footprint, fix.footprint[0]]
            footprints.setdefault(fix.status, []).append([_here(corner, here[1]) for corner in closed])
        if fix.sigma_m is not None and math.isfinite(fix.sigma_m):
            layers["one sigma"].append(folium.Circle(here, fix.sigma_m, color=COLOURS[fix.status], weight=1, fill=True))
        if truth is not None:
            errors.append([here, _here(truth, here[1])])
    # One element for all that nobody clicks at: a page of a thousand fixes is written, and opens, sooner.
    for status, rings in footprints.items():
        layers["footprints"].append(folium.PolyLine(rings, color=COLOURS[status], weight=1))
    if errors:
        layers["errors"].append(folium.PolyLine(errors, color=COLOURS["error"], weight=2, dash_array="4"))
    return layers


def _dot(place: tuple[float, float], kind: str, text: str) -> folium.CircleMarker:
    dot = folium.CircleMarker(
        place, radius=5, color="white", weight=1.5, fill=True, fill_color=COLOURS[kind], fill_opacity=1
    )
    Popup(text).add_to(dot)
    return dot


def _label(name: str) -> str:
    """Leaflet takes a layer's name for HTML."""
    return escape(clean(name))


def _here(place: tuple[float, float], meridian: float) -> tuple[float, float]:
    return place[0], unwrapped_deg(place[1], meridian)


def _continuous(places: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """The line with each longitude within 180 degrees of the one before."""
    line = [places[0]]
    for latitude, longitude in places[1:]:
        line.append((latitude, unwrapped_deg(longitude, line[-1][1])))
    return line


def _corners(overlay: Overlay) -> Bounds:
    return (overlay.south, overlay.west), (overlay.north, overlay.east)


def _view(overlays: Sequence[Overlay], places: Sequence[tuple[float, float]]) -> Bounds | None:
    """What the page shows when it opens; None if there is nothing to show."""
    boxes = [_corners(overlay) for overlay in overlays]
    everything = _around([corner for box in boxes for corner in box] + list(places))
    if everything is None or not boxes:
        return everything
    (south, west), (north, east) = everything
    first = overlays[0]
    fits = north - south <= _SPREAD * (first.north - first.south) and east - west <= _SPREAD * (first.east - first.west)
    return everything if fits else boxes[0]


def _around(places: Iterable[tuple[float, float]]) -> Bounds | None:
    points = list(places)
    if not points:
        return None
    latitudes, longitudes = zip(*points, strict=True)
    return (min(latitudes), min(longitudes)), (max(latitudes), max(longitudes))


def _view_script(view: Bounds | None, views: Sequence[Bounds]) -> str:
    """Opens the page on `view`; the legend's links go to the maps, which it names by their number."""
    start = f"map.fitBounds({json.dumps(view)}, {{maxZoom: 20, padding: [20, 20]}});" if view else ""
    return (
        f"map.setMaxZoom(24); {start} var views = {json.dumps(views)};"
        "document.querySelectorAll('[data-view]').forEach(function(link) { link.onclick = function() {"
        "map.fitBounds(views[link.dataset.view]); return false; }; });"
    )
