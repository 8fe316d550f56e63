"""From per-image records to the rows of Table 1: one per method, with intervals, sources and the Retinex's state."""

import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from diffnav.evaluation.aggregate import Row, difference, mean_with_interval, means_by_source, median, rounded
from diffnav.evaluation.methods import Method
from diffnav.evaluation.provenance import device_name
from diffnav.evaluation.records import ImageRecord
from diffnav.evaluation.seeds import seed_rows
from diffnav.retinex.state import illumination_is_alive

SCORES = ("psnr", "ssim")


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


def compare_seeds(
    records: Sequence[ImageRecord], groups: Mapping[str, Sequence[str]], controls: Mapping[str, str], seed: int = 0
) -> dict[str, list[Row]]:
    """Score -> `seed_rows`; nothing without groups."""
    values: dict[str, dict[str, dict[str, float]]] = {score: {} for score in SCORES if groups}
    for score, methods in values.items():
        for record in records:
            methods.setdefault(record.method, {})[record.name] = getattr(record, score)
    return {score: seed_rows(methods, groups, controls, seed=seed) for score, methods in values.items()}


def _row(
    method: Method,
    records: Sequence[ImageRecord],
    rivals: Sequence[ImageRecord] | None,
    reference: str | None,
    seed: int,
) -> Row:
    failures = [{"name": r.name, "why": r.failure} for r in records if r.failure]
    scored = records if len(failures) < len(records) else []
    state = _mean_state(records)
    row: Row = {"method": method.name}
    for score in SCORES:
        row |= mean_with_interval(score, [getattr(r, score) for r in scored], seed)
    return {
        **row,
        "seconds": median([r.seconds for r in records]),
        "parameters": method.parameters,
        "n": len(scored),
        "megabytes": round(method.megabytes, 3),
        "device": "; ".join(sorted({r.device for r in records if r.device})) or device_name(method.device),
        "failures": failures,
        "per_source": means_by_source(scored, SCORES),
        "versus": _versus(scored, rivals, reference, seed) if scored and rivals and reference != method.name else None,
        "state": state,
        "illumination_alive": illumination_is_alive(state) if state else None,
    }


def _versus(
    records: Sequence[ImageRecord], rivals: Sequence[ImageRecord], reference: str | None, seed: int
) -> dict[str, Any]:
    differences: dict[str, Any] = {"reference": reference}
    for score in SCORES:
        ours, theirs = ([getattr(r, score) for r in side] for side in (records, rivals))
        differences[score] = difference(ours, theirs, seed)
    return differences


def _mean_state(records: Sequence[ImageRecord]) -> dict[str, float] | None:
    states = [r.state for r in records if r.state]
    if not states:
        return None
    return {name: rounded(statistics.fmean(s[name] for s in states)) for name in states[0]}
