"""The scale study as rows, targets, a Markdown page and a plot with both axes logarithmic."""

import statistics
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from diffnav.evaluation.aggregate import rounded
from diffnav.evaluation.cells import duration, protocol_section
from diffnav.evaluation.figures import save_figure
from diffnav.evaluation.navigation.scale import ScaleRecord
from diffnav.evaluation.tables import markdown_table

Row = Mapping[str, Any]
RECALL_M = 10
LIMIT_SECONDS, LIMIT_EXPONENT, LIMIT_LOSS = 1.5, 1.0, 0.02
# Below, constant costs hide how seconds grow.
_GROWTH_FROM = 100
_COLOURS = {"shortlist": "#d62728", "exhaustive": "#1f77b4"}

_NOTES = f"""`s`, `p90`: seconds per query, median and 90th percentile, from the picture in memory to the answer;
`@{RECALL_M} m`: share of the queries answered within; `rank 1`, `5`, `10`: share whose tile, the one that shows the
query's middle, is among the first of the shortlist; up to four tiles show a part of a query. `index`, `features`: on
disk. `peak`: the most that the process held, of that `libraries` before it opened anything; parts of the files that it
read count. `open`: seconds from the start to the first query; `build`: of the index, and what that took at most."""


def scale_rows(records: Sequence[ScaleRecord]) -> list[dict[str, Any]]:
    """One plain row per number of tiles and mode; the columns are those of the page. Missing figures are None."""
    builds = {record.tiles: record for record in records if record.mode == "index"}
    return [_row(record, builds.get(record.tiles)) for record in records if record.mode != "index"]


def scale_targets(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """Each target with its limit, what was measured, and whether it is met; what could not be measured is left out.

    seconds: of the shortlist, of the most tiles. exponent: of the power of the number of tiles that seconds follow,
    least squares from 100 tiles on. recall_loss: of the shortlist against exhaustive, at worst.
    """
    short = sorted((row for row in rows if row["mode"] == "shortlist"), key=lambda row: row["tiles"])
    every = {row["tiles"]: row[f"recall_{RECALL_M}m"] for row in rows if row["mode"] == "exhaustive"}
    measured = {"seconds": (LIMIT_SECONDS, short[-1]["seconds"])}
    if (exponent := growth(rows, "shortlist")) is not None:
        measured["exponent"] = (LIMIT_EXPONENT, exponent)
    if losses := [every[row["tiles"]] - row[f"recall_{RECALL_M}m"] for row in short if row["tiles"] in every]:
        measured["recall_loss"] = (LIMIT_LOSS, rounded(max(losses)))
    return {
        name: {"limit": limit, "measured": value, "met": value <= limit} for name, (limit, value) in measured.items()
    }


def growth(rows: Sequence[Row], mode: str) -> float | None:
    """The power of the number of tiles that a mode's median seconds follow from 100 tiles on; None of fewer than 2."""
    own = [(row["tiles"], row["seconds"]) for row in rows if row["mode"] == mode and row["tiles"] >= _GROWTH_FROM]
    if len(own) < 2:
        return None
    tiles, seconds = np.log(np.array(own)).T
    return rounded(float(np.polyfit(tiles, seconds, 1)[0]))


def scale_page(rows: Sequence[Row], targets: Mapping[str, Row], protocol: Mapping[str, Any]) -> str:
    """The whole page."""
    parts = ["# Scale: from nine tiles to a hundred thousand", "![Seconds and memory against tiles](scale.png)"]
    parts += [scale_table(rows), _NOTES, "## Targets", _targets_table(targets), protocol_section(protocol)]
    return "\n\n".join(parts) + "\n"


def scale_table(rows: Sequence[Row]) -> str:
    """One line per number of tiles and mode."""
    columns = ["tiles", "mode", "queries", "s", "p90", f"@{RECALL_M} m", "rank 1", "5", "10", "index, GB",
               "features, GB", "peak, GB", "libraries, GB", "open, s", "build, s", "build, GB"]  # fmt: skip
    return markdown_table(columns, [_line(row) for row in rows])


def write_scale_plot(path: Path, rows: Sequence[Row]) -> None:
    """Seconds per query with their 90th percentile, and memory, against the number of tiles."""
    figure = Figure((10.4, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    for mode, colour in _COLOURS.items():
        own = sorted((row for row in rows if row["mode"] == mode), key=lambda row: row["tiles"])
        tiles = [row["tiles"] for row in own]
        power = growth(rows, mode)
        label = mode if power is None else f"{mode}, tiles^{power:.2f}"
        left.plot(tiles, [row["seconds"] for row in own], "o-", color=colour, label=label)
        left.fill_between(tiles, *([row[key] for row in own] for key in ("seconds", "p90_seconds")), color=colour,
                          alpha=0.2, linewidth=0)  # fmt: skip
        right.plot(tiles, [row["peak_gb"] for row in own], "o-", color=colour, label=f"{mode}: peak of the process")
    short = sorted((row for row in rows if row["mode"] == "shortlist"), key=lambda row: row["tiles"])
    for key, style in (("index_gb", ":"), ("features_gb", "--")):
        right.plot([row["tiles"] for row in short], [row[key] for row in short], style, color="#555555",
                   label=f"{key.removesuffix('_gb')} on disk")  # fmt: skip
    left.axhline(LIMIT_SECONDS, color="#555555", linewidth=0.8, linestyle=":", label=f"{LIMIT_SECONDS} s")
    _finish(left, "seconds per query")
    _finish(right, "GB")
    save_figure(figure, path)


def _finish(axis: Axes, label: str) -> None:
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xlabel("tiles")
    axis.set_ylabel(label)
    axis.grid(alpha=0.25, which="both")
    axis.legend(fontsize=7)


def _row(record: ScaleRecord, build: ScaleRecord | None) -> dict[str, Any]:
    short = record.mode == "shortlist"
    near = [error is not None and error <= RECALL_M for error in record.errors_m]
    return {
        "tiles": record.tiles,
        "mode": record.mode,
        "queries": len(near),
        "seconds": rounded(statistics.median(record.seconds)),
        "p90_seconds": rounded(float(np.quantile(record.seconds, 0.9))),
        f"recall_{RECALL_M}m": rounded(sum(near) / len(near)),
        **{f"rank_{k}": rounded(sum(r <= k for r in record.ranks) / len(near)) if short else None for k in (1, 5, 10)},
        "index_gb": None if record.index_bytes is None else rounded(record.index_bytes / 1e9),
        "features_gb": rounded(record.feature_bytes / 1e9),
        "peak_gb": rounded(record.peak_gb),
        "libraries_gb": rounded(record.idle_gb),
        "open_seconds": rounded(record.open_seconds),
        "build_seconds": rounded(build.open_seconds) if build and short else None,
        "build_gb": rounded(build.peak_gb) if build and short else None,
        "milliseconds": {name: rounded(value) for name, value in record.milliseconds.items()},
    }


def _line(row: Row) -> dict[str, str]:
    columns = {"s": "seconds", "p90": "p90_seconds", "open, s": "open_seconds", "build, s": "build_seconds"}
    shares = {f"@{RECALL_M} m": f"recall_{RECALL_M}m", "rank 1": "rank_1", "5": "rank_5", "10": "rank_10"}
    sizes = {f"{name}, GB": f"{name}_gb" for name in ("index", "features", "peak", "libraries", "build")}
    return {
        "tiles": f"{row['tiles']:,}",
        "mode": row["mode"],
        "queries": str(row["queries"]),
        **{column: duration(row[key]) for column, key in columns.items()},
        **{column: "-" if row[key] is None else f"{row[key]:.3f}" for column, key in shares.items()},
        **{column: "-" if row[key] is None else f"{row[key]:.2g}" for column, key in sizes.items()},
    }


def _targets_table(targets: Mapping[str, Row]) -> str:
    rows = [
        {
            "target": name.replace("_", " "),
            "limit": f"{target['limit']:g}",
            "measured": f"{target['measured']:.3g}",
            "met": "yes" if target["met"] else "no",
        }
        for name, target in targets.items()
    ]
    return markdown_table(["target", "limit", "measured", "met"], rows)
