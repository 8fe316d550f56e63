"""Figure 10 of the paper: a query in several versions, its matches with the map, and where it was placed."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from diffnav.data.queries.query import Query
from diffnav.evaluation.match_figure import draw_matches
from diffnav.evaluation.navigation.records import NavigationRecord
from diffnav.evaluation.navigation.searcher import Searcher
from diffnav.evaluation.navigation.trial import Trial
from diffnav.geometry.georeference import ground_sample_distance_m
from diffnav.images import shrink, to_uint8
from diffnav.matching.verification import verify
from diffnav.navigation.ground import Ground
from diffnav.navigation.mosaic import ground_picture

# Half a side of the piece of map shown around the place, in widths of the query.
_AROUND = 1.5
_PIXELS = 900
_LINE_INCHES = 2.9
# What the drawing library can draw at once.
_TALLEST_PX = 60_000


def write_figure_10(
    path: Path, records: Sequence[NavigationRecord], queries: Sequence[Query], trial: Trial, count: int
) -> None:
    """Write the figure for at most `count` queries with truth, those first on which the rows disagree most.

    One line per method: the picture as it was matched; its matches with the map around the truth, those that agree on a
    homography green; the map, with the picture's outline in red, its centre red in a yellow box, the truth as a cross.
    Of the first search that has a matcher, in the dark where it was asked. Nothing is written where there is none.
    """
    searcher = next((one for one in trial.searchers if one.matcher is not None), None)
    chosen = _chosen(records, queries, searcher, count) if searcher else []
    if searcher is None or not chosen:
        return
    lines = [(query, record) for query, own in chosen for record in own]
    height = _LINE_INCHES * len(lines)
    figure = Figure((13, height), dpi=min(80, _TALLEST_PX / height))
    axes = figure.subplots(len(lines), 3, squeeze=False, width_ratios=[3, 6, 3])
    for (query, record), (left, middle, right) in zip(lines, axes, strict=True):
        _draw(query, record, trial, searcher, left, middle, right)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    FigureCanvasAgg(figure).print_png(str(path))


def _chosen(
    records: Sequence[NavigationRecord], queries: Sequence[Query], searcher: Searcher, count: int
) -> list[tuple[Query, list[NavigationRecord]]]:
    """The queries to show, each with the records of its rows."""
    by_name: dict[str, list[NavigationRecord]] = {}
    search = (searcher.matcher_name, searcher.mode)
    for record in records:
        if record.has_truth and record.on_map and (record.matcher, record.mode) == search:
            by_name.setdefault(record.name, []).append(record)
    for name, own in by_name.items():
        if any(record.condition == "dark" for record in own):
            by_name[name] = [record for record in own if record.condition == "dark"]
    known = {query.name: query for query in queries}
    ranked = sorted(by_name, key=lambda name: len({record.is_fix for record in by_name[name]}), reverse=True)
    return [(known[name], by_name[name]) for name in ranked[:count]]


def _draw(
    query: Query, record: NavigationRecord, trial: Trial, searcher: Searcher, left: Axes, middle: Axes, right: Axes
) -> None:
    assert query.truth is not None and searcher.matcher is not None and searcher.tile_matcher is not None  # noqa: PT018
    prepared, _ = trial.pictures(query).prepared(record.condition, record.method)
    fix = record.fix
    place = fix.place if fix.place is not None and (record.error_m or 0) < 1000 else query.truth
    pixel_m = float(ground_sample_distance_m(trial.maps[0].georeference))
    picture = prepared.image if prepared.image is not None else torch.zeros(3, 64, 64)
    width_m = picture.shape[2] * (query.ground_sample_distance_m or fix.ground_sample_distance_m or pixel_m)
    picture = shrink(picture, searcher.search.longest_side)
    pixel_m = max(pixel_m, 2 * _AROUND * width_m / _PIXELS)
    side = round(2 * _AROUND * width_m / pixel_m)
    corner = Ground(place, 1.0).latlon(np.array([[-_AROUND * width_m, -_AROUND * width_m]]))[0]
    ground = Ground((float(corner[0]), float(corner[1])), pixel_m)
    shown, _ = ground_picture(trial.maps, ground, (side, side))
    left.imshow(to_uint8(picture))
    left.set_title(f"{record.method}, {record.condition}: {query.name}"[:48], fontsize=8)
    if record.failure is None:
        matcher = searcher.matcher.matcher
        matches = matcher.match(matcher.features(picture), searcher.tile_matcher.matcher.features(shown))
        middle.imshow(draw_matches(picture, shown, matches, verify(matches).inliers, word="agree"))
        middle.set_title("matches around the place: agreeing green, others red", fontsize=8)
    right.imshow(to_uint8(shown))
    _mark(right, record, query.truth, ground, side)
    for axis in (left, middle, right):
        axis.set_axis_off()


def _mark(axis: Axes, record: NavigationRecord, truth: tuple[float, float], ground: Ground, side: int) -> None:
    """Outline, centre and truth on the map."""
    fix = record.fix
    x, y = ground.points(np.array([truth]))[0]
    axis.plot(x, y, "+", color="white", markersize=11, markeredgewidth=1.6)
    title = "no fix: " + "; ".join(fix.reasons)
    if fix.place is not None:
        if fix.footprint:
            outline = ground.points(np.array([*fix.footprint, fix.footprint[0]]))
            axis.plot(*outline.T, color="red", linewidth=1.6)
        centre = ground.points(np.array([fix.place]))[0]
        box = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * side / 40
        axis.plot(*(centre + box).T, color="yellow", linewidth=1.4)
        axis.plot(*centre, ".", color="red", markersize=5)
        title = f"{fix.inliers} inliers, {record.error_m:.2f} m off" if record.error_m is not None else "fix"
    axis.set_title(title[:60], fontsize=8)
    axis.set_xlim(0, side)
    axis.set_ylim(side, 0)
