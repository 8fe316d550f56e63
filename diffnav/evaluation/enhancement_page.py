"""The enhancement experiment as one Markdown page: Table 1, per source, the Retinex's state, failures, protocol."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from diffnav.evaluation.rows import Row
from diffnav.evaluation.tables import markdown_table

# Table 1 of the paper, on its own 120 pictures: PSNR, SSIM, seconds per image (its section 8).
PAPER = {
    "Dong": (13.9642, 0.4251, 0.61),
    "MF": (15.1901, 0.4921, 1.63),
    "SRIE": (11.2053, 0.3412, 58.02),
    "NPE": (15.2126, 0.4883, 6.52),
    "LightenNet": (12.8605, 0.4254, 6.08),
    "the paper's network": (21.0668, 0.6882, 0.11),
}


def enhancement_page(rows: Sequence[Row], protocol: Mapping[str, Any]) -> str:
    """The whole page; `rows` as `enhancement_rows` makes them, `protocol` any plain values."""
    parts = ["# Enhancement: PSNR and SSIM", scores_table(rows), _NOTES]
    if failures := failure_lines(rows):
        parts += ["## Failures", "\n".join(f"- {line}" for line in failures)]
    if any(figures["n"] > 1 for row in rows for figures in row["per_source"].values()):
        parts += ["## By source, PSNR / SSIM", sources_table(rows)]
    if any(row["state"] for row in rows):
        parts += ["## Is the Retinex alive?", state_table(rows), _STATE_NOTES]
    parts += ["## The paper's own figures", _PAPER_NOTES, _paper_table()]
    facts = (f"- {name}: `{json.dumps(value, ensure_ascii=False)}`" for name, value in protocol.items())
    parts += ["## Protocol", "\n".join(facts)]
    return "\n\n".join(parts) + "\n"


def scores_table(rows: Sequence[Row]) -> str:
    """Method, scores with 95 % intervals, the difference to the reference method, costs."""
    reference = next((row["versus"]["reference"] for row in rows if row["versus"]), None)
    over = f"dB over {reference}"
    columns = ["method", "PSNR, dB", "SSIM", *([over] if reference else [])]
    lines = [
        {
            "method": row["method"],
            "PSNR, dB": _with_interval(row["psnr"], row["psnr_ci"], 2),
            "SSIM": _with_interval(row["ssim"], row["ssim_ci"], 3),
            over: _with_interval(row["versus"]["psnr"][0], row["versus"]["psnr"][1:], 2, "+") if row["versus"] else "",
            "s per image": _duration(row["seconds"]),
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


def failure_lines(rows: Sequence[Row]) -> list[str]:
    """One sentence per method and picture that failed, one in all for a method that failed on every picture."""
    lines = []
    for row in rows:
        failures = row["failures"]
        if failures and row["n"] == 0:
            lines.append(f"{row['method']} on all {len(failures)}: {failures[0]['why']}")
        else:
            lines += [f"{row['method']} on {one['name']}: {one['why']}" for one in failures]
    return lines


def _paper_table() -> str:
    columns = ["method", "PSNR, dB", "SSIM", "s per image"]
    cells = ((name, f"{psnr:.2f}", f"{ssim:.3f}", f"{seconds:g}") for name, (psnr, ssim, seconds) in PAPER.items())
    return markdown_table(columns, [dict(zip(columns, line, strict=True)) for line in cells])


def _duration(seconds: float | None) -> str:
    if seconds is None:
        return "-"
    return f"{seconds:.3g}" if seconds >= 0.001 else "< .001"


def _with_interval(value: float | None, interval: Sequence[float] | None, digits: int, sign: str = "-") -> str:
    if value is None or interval is None:
        return "-"
    low, high = (f"{bound:{sign}.{digits}f}" for bound in interval)
    return f"{value:{sign}.{digits}f} [{low}, {high}]"


_NOTES = (
    "In brackets: 95 % bootstrap interval of the mean. Scores are of 8-bit pictures, data range 1, SSIM window 11, "
    "sigma 1.5, mean over channels. A failure counts with the scores of the dark input. Seconds are the median after "
    "a warm-up, without reading and writing; networks run on the protocol's device, the others on its CPU."
)
_STATE_NOTES = (
    "Mean ± standard deviation within a picture, and the share of values within .01 of 0 or 1, over all pictures. "
    "An illumination Ih that hardly varies or saturates is no longer one: the network then restores pictures directly."
)
_PAPER_NOTES = "Printed in the paper, on 120 other pictures and another machine: not comparable with the rows above."
