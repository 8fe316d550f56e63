"""The spectra as a plot and as a Markdown page: two tables, coherence and gain of every method in every band."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from diffnav.evaluation.aggregate import Row
from diffnav.evaluation.cells import failure_lines, protocol_section, with_interval
from diffnav.evaluation.figures import save_figure
from diffnav.evaluation.method_styles import method_styles
from diffnav.evaluation.spectrum import BANDS
from diffnav.evaluation.tables import markdown_table

# A network's parts have its colour.
_PART_LINES = {"R": "--", "Ih": ":"}


def spectrum_page(rows: Sequence[Row], protocol: Mapping[str, Any]) -> str:
    """The whole page; `rows` as `spectrum_rows` makes them, `protocol` any plain values."""
    parts = ["# What an enhanced picture holds of the daylight picture, by spatial frequency", _NOTES]
    if any(row["part"] for row in rows):
        parts += [_PART_NOTES]
    parts += ["![Coherence against frequency](spectrum.png)"]
    for figure in ("coherence", "gain"):
        parts += [f"## {figure.capitalize()}", bands_table(rows, figure)]
    if failures := failure_lines(rows):
        parts += ["## Failures", "\n".join(f"- {line}" for line in failures)]
    return "\n\n".join([*parts, protocol_section(protocol)]) + "\n"


def bands_table(rows: Sequence[Row], figure: str) -> str:
    """One line per method, one column per band: the mean of `figure` (coherence or gain) with its interval."""
    columns = [f"1/{1 / high:g} to 1/{1 / low:g}" for low, high in BANDS]
    lines = [
        {"method": row["method"]}
        | {
            column: with_interval(band[figure], band[f"{figure}_ci"], 3)
            for column, band in zip(columns, row["bands"], strict=True)
        }
        for row in rows
    ]
    return markdown_table(["method", *columns], lines)


def write_spectrum_plot(path: Path, rows: Sequence[Row]) -> None:
    """Write the mean coherence against frequency: one line per method, a point at the middle of every octave."""
    figure = Figure((8.0, 4.4), layout="constrained")
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    styles = method_styles(list(dict.fromkeys(row["enhancer"] for row in rows)))
    for row in rows:
        points = [
            ((band["low"] * band["high"]) ** 0.5, band["coherence"])
            for band in row["bands"]
            if band["coherence"] is not None
        ]
        style = styles[row["enhancer"]]
        style = style | {"linestyle": _PART_LINES.get(row["part"], style["linestyle"])}
        axis.plot(*zip(*points, strict=True), label=row["method"], markersize=3.5, linewidth=1.4, **style)
    edges = sorted({edge for band in BANDS for edge in band})
    axis.set_xscale("log", base=2)
    axis.set_xticks(edges, [f"1/{1 / edge:g}" for edge in edges])
    axis.set_xlim(edges[0], edges[-1])
    axis.set_ylim(-0.3, 1.02)
    axis.set_xlabel("spatial frequency, cycles per pixel")
    axis.set_ylabel("coherence with daylight, mean")
    axis.grid(alpha=0.25)
    figure.legend(loc="outside right upper", fontsize=8)
    save_figure(figure, path)


_NOTES = (
    "Luminance (BT.601) of the enhanced picture E and of the daylight picture N, each less its mean and under a Hann "
    "window, in octaves of the spatial frequency in cycles per pixel. Coherence is sum E conj(N) / sqrt(sum |E|^2 "
    "sum |N|^2) over a band's frequencies, whatever the contrast: 1 where E is N but for a factor, near 0 where it "
    "shows something else. Gain is sqrt(sum |E|^2 / sum |N|^2), the contrast in the band, noise included. Means over "
    "the photos with 95 % bootstrap intervals."
)
_PART_NOTES = (
    "`NAME: R` is the luminance of the network's reflectance of the dark picture, `NAME: Ih` its enhanced "
    "illumination, both before they are rounded to 8 bit, against the same N. A band that R does not hold was lost "
    "in the decomposition or in the dark picture itself (see input), or could only come back through Ih; one that R "
    "holds and the picture does not was lost to Ih. The sign is not counted: Ih darker where daylight is brighter is "
    "coherent too."
)
