"""From one figure per picture to a table's: means with intervals, paired differences, means per source."""

import statistics
from collections.abc import Sequence
from typing import Any

from diffnav.evaluation.bootstrap import mean_interval, paired_difference

Row = dict[str, Any]


def mean_with_interval(name: str, values: Sequence[float], seed: int) -> Row:
    """{name: mean, name_ci: its 95 % bootstrap interval}; None for no values."""
    if not values:
        return {name: None, f"{name}_ci": None}
    return {
        name: rounded(statistics.fmean(values)),
        f"{name}_ci": [rounded(bound) for bound in mean_interval(values, seed)],
    }


def difference(values: Sequence[float], reference: Sequence[float], seed: int) -> list[float]:
    """[mean, low, high] of the paired difference `values` - `reference`."""
    return [rounded(value) for value in paired_difference(values, reference, seed)]


def median(values: Sequence[float | None]) -> float | None:
    """The median of those that are not None; None if there are none."""
    known = [value for value in values if value is not None]
    return rounded(statistics.median(known)) if known else None


def means_by_source(records: Sequence[Any], names: Sequence[str]) -> dict[str, dict[str, float]]:
    """Site -> n and the mean of each named field of its records, in alphabetical order."""
    sources: dict[str, list[Any]] = {}
    for record in records:
        sources.setdefault(record.site, []).append(record)
    return {
        site: {"n": len(own), **{name: rounded(statistics.fmean(getattr(r, name) for r in own)) for name in names}}
        for site, own in sorted(sources.items())
    }


def rounded(value: float) -> float:
    """Six decimals: far below what an interval leaves open, and the same on machines that differ in the last bit."""
    return round(value, 6)
