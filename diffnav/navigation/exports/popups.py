"""What is known of one fix, as a small HTML table."""

import math
from html import escape

from diffnav.geometry.geodesy import haversine_m
from diffnav.navigation.exports.fields import clean, place_of, utc
from diffnav.navigation.fix import Fix


def fix_html(fix: Fix, truth: tuple[float, float] | None = None) -> str:
    """The name of the picture, its status and reasons, and all numbers that are there; every text is escaped."""
    rows = "".join(f"<tr><th>{name}</th><td>{_text(value)}</td></tr>" for name, value in _lines(fix, truth).items())
    return f'<b>{_text(fix.query)}</b><table class="known">{rows}</table>'


def _lines(fix: Fix, truth: tuple[float, float] | None) -> dict[str, str]:
    place = place_of(fix)
    lines = {"status": fix.status.replace("_", " ")}
    if fix.reasons:
        lines["reasons"] = "; ".join(fix.reasons)
    if place:
        lines["place"] = f"{place[0]:.7f}, {place[1]:.7f}"
    if place and truth:
        lines["error"] = f"{float(haversine_m(place, truth)):.1f} m"
    numbers = {
        "sigma": (fix.sigma_m, "{:.1f} m"),
        "heading": (fix.heading_deg, "{:.1f}°"),
        "pixel": (fix.ground_sample_distance_m, "{:.3f} m"),
        "definition": (fix.definition, "{:.2f}"),
    }
    for name, (value, shape) in numbers.items():
        if value is not None and math.isfinite(value):
            lines[name] = shape.format(value)
    lines["inliers"] = f"{fix.inliers} of {fix.matches} matches"
    lines["enhanced"] = "yes" if fix.enhanced else "no"
    if fix.map is not None:
        lines["found in"] = fix.map if fix.tile is None else f"{fix.map}, tile {fix.tile}"
    if fix.milliseconds:
        stages = ", ".join(f"{stage} {value:.0f}" for stage, value in fix.milliseconds.items())
        lines["milliseconds"] = f"{sum(fix.milliseconds.values()):.0f} ({stages})"
    if fix.time:
        lines["time"] = f"{utc(fix.time):%Y-%m-%d %H:%M:%S} UTC"
    return lines


def _text(value: str) -> str:
    return escape(clean(value))
