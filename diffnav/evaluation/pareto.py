"""PSNR against correct matches, method by method: what does matching better cost in fidelity?"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from diffnav.errors import UserError
from diffnav.evaluation.aggregate import Row
from diffnav.evaluation.cells import with_interval
from diffnav.evaluation.figures import save_figure
from diffnav.evaluation.tables import markdown_table

_COLUMNS = 2


def read_rows(path: Path) -> list[Row]:
    """The rows of an evaluation's JSON file, those of its recipes over seeds aside. Raises: UserError."""
    try:
        return json.loads(path.read_text())["rows"]
    except (OSError, ValueError, KeyError, TypeError):
        raise UserError(
            f"{path}: not the results of an evaluation; give the enhancement.json or matching.json of one"
        ) from None


def pareto_rows(enhancement: Sequence[Row], matching: Sequence[Row]) -> list[Row]:
    """One row per method and matcher that both evaluations have: psnr, ssim, correct, their intervals, and `front`.

    front: whether no other of the methods has more PSNR and more matches, of one matcher. Raises: UserError if they
    share no method.
    """
    scores = {row["method"]: row for row in enhancement if row["psnr"] is not None}
    rows = [
        {
            "method": row["method"],
            "matcher": row["matcher"],
            **{key: scores[row["method"]][key] for key in ("psnr", "psnr_ci", "ssim")},
            **{key: row[key] for key in ("correct", "correct_ci")},
        }
        for row in matching
        if row["method"] in scores
    ]
    if not rows:
        raise UserError("the two evaluations share no method; measure the same checkpoints in both")
    for row in rows:
        rivals = [other for other in rows if other["matcher"] == row["matcher"]]
        row["front"] = not any(o["psnr"] > row["psnr"] and o["correct"] > row["correct"] for o in rivals)
    return rows


def pareto_page(rows: Sequence[Row], sources: Mapping[str, Any]) -> str:
    """The Markdown page: the plot, and a table in which the front is marked."""
    matchers = list(dict.fromkeys(row["matcher"] for row in rows))
    lines: dict[str, dict[str, str]] = {}
    for row in rows:
        line = lines.setdefault(row["method"], {"method": row["method"]})
        line["PSNR, dB"] = with_interval(row["psnr"], row["psnr_ci"], 2)
        line["SSIM"] = f"{row['ssim']:.3f}"
        line[row["matcher"]] = with_interval(row["correct"], row["correct_ci"], 1) + (" *" if row["front"] else "")
    origin = ", ".join(f"{name}: `{value}`" for name, value in sources.items())
    parts = [
        "# PSNR against correct matches",
        "![PSNR against correct matches](pareto.png)",
        markdown_table(["method", "PSNR, dB", "SSIM", *matchers], list(lines.values())),
        "`*`: on the front, no other method has both more PSNR and more correct matches. Brackets and bars: 95 % "
        "bootstrap intervals over pictures.",
        f"Made of {origin}.",
    ]
    return "\n\n".join(parts) + "\n"


def write_pareto_plot(path: Path, rows: Sequence[Row]) -> None:
    """One panel per matcher: PSNR to the right, correct matches upwards, a line through the front."""
    matchers = list(dict.fromkeys(row["matcher"] for row in rows))
    columns = min(_COLUMNS, len(matchers))
    lines = -(-len(matchers) // columns)
    figure = Figure((5.2 * columns, 4.0 * lines), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(lines, columns, squeeze=False)
    for panel, matcher in zip(panels.flat, matchers, strict=False):
        _draw(panel, [row for row in rows if row["matcher"] == matcher])
        panel.set_title(matcher)
    for panel in panels.flat[len(matchers) :]:
        panel.set_visible(False)
    save_figure(figure, path)


def _draw(panel: Axes, rows: Sequence[Row]) -> None:
    for row in rows:
        colour = "#d62728" if row["front"] else "#1f77b4"
        bars = [[[abs(row[key] - bound)] for bound in row[f"{key}_ci"]] for key in ("psnr", "correct")]
        panel.errorbar(row["psnr"], row["correct"], bars[1], bars[0], "o", color=colour, elinewidth=0.5, markersize=4)
        panel.annotate(row["method"], (row["psnr"], row["correct"]), (4, 3), textcoords="offset points", fontsize=7)
    front = sorted((row["psnr"], row["correct"]) for row in rows if row["front"])
    panel.plot([p for p, _ in front], [c for _, c in front], "-", color="#d62728", linewidth=0.8, alpha=0.6)
    # Around the points: bars, over pictures, are far wider than what paired methods differ by.
    for limit, key in ((panel.set_xlim, "psnr"), (panel.set_ylim, "correct")):
        low, high = min(row[key] for row in rows), max(row[key] for row in rows)
        margin = 0.15 * (high - low) or 1.0
        limit(low - margin, high + margin)
    panel.set_xlabel("PSNR, dB")
    panel.set_ylabel("correct matches, mean")
    panel.grid(alpha=0.25)
