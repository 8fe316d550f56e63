"""The darkness curve as plots and as a Markdown page: where does each method break down?"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from diffnav.evaluation.aggregate import Row
from diffnav.evaluation.cells import protocol_section
from diffnav.evaluation.darkness_curve import breakdown_level
from diffnav.evaluation.figures import save_figure
from diffnav.evaluation.method_styles import method_styles
from diffnav.evaluation.tables import markdown_table

AXES = {
    "gamma": "gamma of Eq. 9",
    "noise": "shot noise at full intensity (standard deviation)",
    "blur_px": "motion blur (px)",
}
_COLUMNS = 3


def write_curve_plots(folder: Path, rows: Sequence[Row]) -> list[Path]:
    """Write darkness_curve_AXIS.png for every axis: one panel per matcher, one line per method; returns the files."""
    written = []
    for axis in dict.fromkeys(row["axis"] for row in rows):
        written.append(folder / f"darkness_curve_{axis}.png")
        _plot(written[-1], axis, [row for row in rows if row["axis"] == axis])
    return written


def curve_page(rows: Sequence[Row], protocol: Mapping[str, Any], left_out: Sequence[str] = ()) -> str:
    """The whole page; `rows` as `curve_rows` makes them, `protocol` any plain values, left_out: sentences."""
    parts = ["# Correct matches against darkness", _NOTES, *(f"Left out: {sentence}." for sentence in left_out)]
    for axis in dict.fromkeys(row["axis"] for row in rows):
        own = [row for row in rows if row["axis"] == axis]
        parts += [f"## {AXES[axis]}", f"![Correct matches against {axis}](darkness_curve_{axis}.png)"]
        parts += [breakdown_table(own)]
    return "\n\n".join([*parts, protocol_section(protocol)]) + "\n"


def breakdown_table(rows: Sequence[Row]) -> str:
    """Of one axis: the level from which on a method has less than half of its most correct matches, and those most.

    "> x": not up to the last level x.
    """
    matchers, methods = (list(dict.fromkeys(row[key] for row in rows)) for key in ("matcher", "method"))
    lines = {method: {"method": method} for method in methods}
    for matcher in matchers:
        for method in methods:
            levels, values = _curve(rows, method, matcher)
            level = breakdown_level(levels, values)
            text = f"> {levels[-1]:g}" if level is None else f"{level:.3g}"
            lines[method][matcher] = f"{text} ({max(values):.0f})"
    return markdown_table(["method", *matchers], list(lines.values()))


def _curve(rows: Sequence[Row], method: str, matcher: str) -> tuple[list[float], list[float]]:
    own = [row for row in rows if (row["method"], row["matcher"]) == (method, matcher)]
    return [row["level"] for row in own], [row["correct"] for row in own]


def _plot(path: Path, axis: str, rows: Sequence[Row]) -> None:
    matchers, methods = (list(dict.fromkeys(row[key] for row in rows)) for key in ("matcher", "method"))
    columns = min(len(matchers), _COLUMNS)
    lines = -(-len(matchers) // columns)
    figure = Figure((4.2 * columns + 1.8, 3.2 * lines), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(lines, columns, squeeze=False)
    for panel, matcher in zip(panels.flat, matchers, strict=False):
        for method, style in method_styles(methods).items():
            levels, values = _curve(rows, method, matcher)
            # Levels that rise by factors stand at equal distances.
            panel.plot(range(len(levels)), values, label=method, markersize=3.5, linewidth=1.4, **style)
            panel.set_xticks(range(len(levels)), [f"{level:g}" for level in levels])
        panel.set_title(matcher)
        panel.set_ylim(bottom=0)
        panel.grid(alpha=0.25)
    for panel in panels.flat[len(matchers) :]:
        panel.set_visible(False)
    for line in panels:
        line[0].set_ylabel("correct matches, mean")
    figure.supxlabel(AXES[axis], fontsize=10)
    handles, labels = panels[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right upper", fontsize=8)
    save_figure(figure, path)


_NOTES = (
    "Mean over the pairs; every photo has the same darkness at a point of a curve, 8 bit and JPEG included. Noise and "
    "blur are added at the protocol's base_gamma. The tables say at which level a method falls, for good, below half "
    "of its own most correct matches on this axis, between measured levels on straight lines; in brackets, how many "
    "those are. Intervals are in darkness_curve.csv."
)
