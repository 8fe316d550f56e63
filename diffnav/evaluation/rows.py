"""From per-image records to the rows of Table 1: one per method, with intervals, sources and the Retinex's state."""

import statistics
from collections.abc import Sequence
from typing import Any

from diffnav.evaluation.bootstrap import mean_interval, paired_difference
from diffnav.evaluation.methods import Method
from diffnav.evaluation.provenance import device_name
from diffnav.evaluation.records import ImageRecord
from diffnav.retinex.state import illumination_is_alive

Row = dict[str, Any]


def enhancement_rows(
    methods: Sequence[Method], records: Sequence[ImageRecord], reference: str | None = "gamma_blind", seed: int = 0
) -> list[Row]:
    """One plain row per method, ready for JSON.

    method, psnr (dB), ssim: means over `n` pictures, failures among them; psnr_ci, ssim_ci: 95 % bootstrap
    intervals; seconds: median per picture, on `device`; parameters; megabytes of float32 weights; failures: which
    pictures and why; per_source: n, psnr, ssim of each site; versus: mean and interval of the paired difference to
    the method `reference`; state, illumination_alive: of R, I, Ih, None where there are none. A method that failed
    on every picture has no scores (None) and n = 0.
    """
    by_method = {method.name: [r for r in records if r.method == method.name] for method in methods}
    return [_row(method, by_method[method.name], by_method.get(reference or ""), reference, seed) for method in methods]


def _row(
    method: Method,
    records: Sequence[ImageRecord],
    rivals: Sequence[ImageRecord] | None,
    reference: str | None,
    seed: int,
) -> Row:
    failures = [{"name": r.name, "why": r.failure} for r in records if r.failure]
    scored = records if len(failures) < len(records) else []
    seconds = [r.seconds for r in records if r.seconds is not None]
    state = _mean_state(records)
    row: Row = {"method": method.name}
    for score in ("psnr", "ssim"):
        values = [getattr(r, score) for r in scored]
        row[score] = _rounded(statistics.fmean(values)) if values else None
        row[f"{score}_ci"] = [_rounded(bound) for bound in mean_interval(values, seed)] if values else None
    return {
        **row,
        "seconds": _rounded(statistics.median(seconds)) if seconds else None,
        "parameters": method.parameters,
        "n": len(scored),
        "megabytes": round(method.megabytes, 3),
        "device": device_name(method.device),
        "failures": failures,
        "per_source": _per_source(scored),
        "versus": _versus(scored, rivals, reference, seed) if scored and rivals and reference != method.name else None,
        "state": state,
        "illumination_alive": illumination_is_alive(state) if state else None,
    }


def _versus(
    records: Sequence[ImageRecord], rivals: Sequence[ImageRecord], reference: str | None, seed: int
) -> dict[str, Any]:
    differences: dict[str, Any] = {"reference": reference}
    for score in ("psnr", "ssim"):
        ours, theirs = ([getattr(r, score) for r in side] for side in (records, rivals))
        differences[score] = [_rounded(value) for value in paired_difference(ours, theirs, seed)]
    return differences


def _per_source(records: Sequence[ImageRecord]) -> dict[str, dict[str, float]]:
    sources: dict[str, list[ImageRecord]] = {}
    for record in records:
        sources.setdefault(record.site, []).append(record)
    return {
        site: {
            "n": len(own),
            "psnr": _rounded(statistics.fmean(r.psnr for r in own)),
            "ssim": _rounded(statistics.fmean(r.ssim for r in own)),
        }
        for site, own in sorted(sources.items())
    }


def _mean_state(records: Sequence[ImageRecord]) -> dict[str, float] | None:
    states = [r.state for r in records if r.state]
    if not states:
        return None
    return {name: _rounded(statistics.fmean(s[name] for s in states)) for name in states[0]}


def _rounded(value: float) -> float:
    """Six decimals: far below what an interval leaves open, and the same on machines that differ in the last bit."""
    return round(value, 6)
