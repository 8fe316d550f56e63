"""The enhancement experiment as one Markdown page: Table 1, per source, the Retinex's state, failures, protocol."""

from collections.abc import Mapping, Sequence
from typing import Any

from diffnav.evaluation.aggregate import Row
from diffnav.evaluation.cells import duration, failure_lines, protocol_section, with_interval
from diffnav.evaluation.paper_results import NOT_OURS, paper_table_1
from diffnav.evaluation.seeds import seed_sections
from diffnav.evaluation.tables import markdown_table


def enhancement_page(
    rows: Sequence[Row], protocol: Mapping[str, Any], compared: Mapping[str, Sequence[Row]] | None = None
) -> str:
    """The whole page; `rows` as `enhancement_rows` makes them, `protocol` any plain values.

    compared: score -> `seed_rows`, of recipes trained several times.
    """
    parts = ["# Enhancement: PSNR and SSIM", scores_table(rows), _NOTES, *seed_sections(compared or {}, digits=3)]
    if failures := failure_lines(rows):
        parts += ["## Failures", "\n".join(f"- {line}" for line in failures)]
    if any(figures["n"] > 1 for row in rows for figures in row["per_source"].values()):
        parts += ["## By source, PSNR / SSIM", sources_table(rows)]
    if any(row["state"] for row in rows):
        parts += ["## Is the Retinex alive?", state_table(rows), _STATE_NOTES]
    parts += ["## The paper's own figures", NOT_OURS, paper_table_1(), protocol_section(protocol)]
    return "\n\n".join(parts) + "\n"


def scores_table(rows: Sequence[Row]) -> str:
    """Method, scores with 95 % intervals, the difference to the reference method, costs."""
    reference = next((row["versus"]["reference"] for row in rows if row["versus"]), None)
    over = f"dB over {reference}"
    columns = ["method", "PSNR, dB", "SSIM", *([over] if reference else [])]
    lines = [
        {
            "method": row["method"],
            "PSNR, dB": with_interval(row["psnr"], row["psnr_ci"], 2),
            "SSIM": with_interval(row["ssim"], row["ssim_ci"], 3),
            over: with_interval(row["versus"]["psnr"][0], row["versus"]["psnr"][1:], 2, "+") if row["versus"] else "",
            "s per image": duration(row["seconds"]),
            "parameters": f"{row['parameters']:,}",
            "MB": f"{row['megabytes']:.2f}",
            "n": str(row["n"]),
        }
        for row in rows
    ]
    return markdown_table([*columns, "s per image", "parameters", "MB", "n"], lines)


def sources_table(rows: Sequence[Row]) -> str:
    """One line per source, one column per method: mean PSNR / SSIM."""
    lines: dict[str, dict[str, str]] = {}
    for row in rows:
        for source, figures in row["per_source"].items():
            line = lines.setdefault(source, {"source": source, "n": str(figures["n"])})
            line[row["method"]] = f"{figures['psnr']:.2f} / {figures['ssim']:.3f}"
    return markdown_table(["source", "n", *(row["method"] for row in rows)], list(lines.values()))


def state_table(rows: Sequence[Row]) -> str:
    """Mean, standard deviation and saturated share of R, I, Ih of every Retinex network."""
    lines = []
    for row in rows:
        if state := row["state"]:
            line = {"method": row["method"], "illumination": "alive" if row["illumination_alive"] else "collapsed"}
            for part in ("R", "I", "Ih"):
                mean, spread, saturated = (state[f"{part}_{figure}"] for figure in ("mean", "std", "saturated"))
                line[part] = f"{mean:.3f} ± {spread:.3f}, {100 * saturated:.1f} %"
            lines.append(line)
    return markdown_table(["method", "R", "I", "Ih", "illumination"], lines)


_NOTES = (
    "In brackets: 95 % bootstrap interval of the mean. Scores are of 8-bit pictures, data range 1, SSIM window 11, "
    "sigma 1.5, mean over channels. A failure counts with the scores of the dark input. Seconds are the median after "
    "a warm-up, without reading and writing; networks run on the protocol's device, the others on its CPU."
)
_STATE_NOTES = (
    "Mean ± standard deviation within a picture, and the share of values within .01 of 0 or 1, over all pictures. "
    "An illumination Ih that hardly varies or saturates is no longer one: the network then restores pictures directly."
)
