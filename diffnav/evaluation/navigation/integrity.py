"""Availability against false fixes: what asking for more inliers costs, and what it buys."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from diffnav.evaluation.navigation.records import NavigationRecord
from diffnav.evaluation.navigation.rows import FALSE_M, wilson_upper

_MOST = 60


def integrity_curves(records: Sequence[NavigationRecord]) -> list[dict[str, Any]]:
    """One curve per method, matcher, mode and condition, against the least number of inliers that a fix must have.

    min_inliers: from the fewest of any fix to 60; availability: fixes over queries on the map; wrong: false fixes and
    fixes off the map; asked: queries with truth or off the map; wrong_upper: of wrong over asked, Wilson's 95 % bound.
    Figures that do not exist are None. Rows without a fix, or whose search counts no inliers, have no curve.
    """
    groups: dict[tuple[str, str, str, str], list[NavigationRecord]] = {}
    for record in records:
        groups.setdefault((record.method, record.matcher, record.mode, record.condition), []).append(record)
    labels = ("method", "matcher", "mode", "condition")
    curves = []
    for row, own in groups.items():
        fewest = min((record.answer["inliers"] for record in own if record.is_fix), default=0)
        if fewest:
            points = [_point(own, least) for least in range(fewest, max(_MOST, fewest) + 1)]
            curves.append(dict(zip(labels, row, strict=True)) | {"points": points})
    return curves


def write_integrity_plot(path: Path, curves: Sequence[dict[str, Any]]) -> None:
    """Draw the curves: availability above, the bound of wrong fixes below."""
    figure = Figure((8, 7), dpi=100)
    above, below = figure.subplots(2, 1, sharex=True)
    for curve in curves:
        name = ", ".join(curve[key] for key in ("method", "matcher", "mode", "condition"))
        points = curve["points"]
        least = [point["min_inliers"] for point in points]
        # Both exist all along a curve or nowhere on it.
        if points[0]["availability"] is not None:
            above.plot(least, [point["availability"] for point in points], label=name, linewidth=1.3)
        if points[0]["wrong_upper"] is not None:
            below.plot(least, [100 * point["wrong_upper"] for point in points], label=name, linewidth=1.3)
    above.set_ylabel("availability on the map")
    labelled = next((axis for axis in (above, below) if axis.lines), None)
    if labelled is not None:
        labelled.legend(fontsize=6)
    below.set_ylabel("wrong fixes, upper 95 % bound, %")
    below.set_yscale("log")
    below.set_xlabel("least number of inliers")
    for axis in (above, below):
        axis.grid(alpha=0.25)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    FigureCanvasAgg(figure).print_png(str(path))


def _point(records: Sequence[NavigationRecord], least: int) -> dict[str, Any]:
    told = [record for record in records if record.is_fix and record.answer["inliers"] >= least]
    inside = sum(record.on_map for record in records)
    asked = sum(not record.on_map or record.has_truth for record in records)
    wrong = sum(not record.on_map or (record.error_m or 0) > FALSE_M for record in told)
    return {
        "min_inliers": least,
        "availability": sum(record.on_map for record in told) / inside if inside else None,
        "wrong": wrong,
        "asked": asked,
        "wrong_upper": wilson_upper(wrong, asked),
    }
