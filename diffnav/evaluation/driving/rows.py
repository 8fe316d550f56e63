"""From records to the rows of the driving table (Table 3): accuracy, with neighbours, in metres, gap closed."""

import statistics
from collections.abc import Sequence
from typing import Any

import numpy as np

from diffnav.data.driving.driving_set import DrivingSet, frames_apart, metres_apart
from diffnav.evaluation.aggregate import rounded
from diffnav.evaluation.bootstrap import mean_interval, percentiles, resamples
from diffnav.evaluation.driving.records import RANKINGS, DrivingRecord

WITHIN_M = (2, 5, 10)
# The dark picture and the daylight one: between them lies the gap that an enhancer can close.
LOW, HIGH = "input", "normal"
_DRAWS = 10_000


def driving_rows(records: Sequence[DrivingRecord], drive: DrivingSet, seed: int = 0) -> list[dict[str, Any]]:
    """One plain row per method, matcher and ranking, in the order of their first records.

    ranking: of `RANKINGS`. queries, references: how many. accuracy: share of the queries answered
    with their partner, with accuracy_ci, the 95 % bootstrap interval; accuracy_pm1: with it or a neighbour, of
    consecutive drives; accuracy_2m, 5m, 10m: within that distance, where positions are known. mp: mean matches with
    the answer (PAPER 7); mp_partner: with the partner. gap_closed: (accuracy - low) / (normal - low) among the same
    queries, with gap_closed_ci; None where there is no gap. seconds: median per query from the dark picture to the
    answer. failures: name and why. Figures that do not exist are None.
    """
    groups: dict[tuple[str, str], list[DrivingRecord]] = {}
    for record in records:
        groups.setdefault((record.method, record.matcher), []).append(record)
    rankings = [
        ranking for ranking in RANKINGS if ranking == "matches" or any(record.accepted(ranking) for record in records)
    ]
    return [_row(own, groups, ranking, drive, seed) for ranking in rankings for own in groups.values()]


def hits(records: Sequence[DrivingRecord], ranking: str) -> np.ndarray:
    """(n,) 1 where the answer is the partner, else 0."""
    return np.array([float(record.answer(ranking) == record.truth) for record in records])


def offsets(records: Sequence[DrivingRecord], drive: DrivingSet, ranking: str) -> list[float | None]:
    """How many moments each answer lies after its partner, infinity in another record; None without an answer."""
    found: list[float | None] = []
    for record in records:
        answer = record.answer(ranking)
        if answer is None:
            found.append(None)
            continue
        there, partner = drive.references[answer], drive.references[record.truth]
        apart = frames_apart(there, partner)
        found.append(apart if there.index >= partner.index else -apart)
    return found


def _row(
    records: Sequence[DrivingRecord],
    groups: dict[tuple[str, str], list[DrivingRecord]],
    ranking: str,
    drive: DrivingSet,
    seed: int,
) -> dict[str, Any]:
    first = records[0]
    right = hits(records, ranking)
    off = offsets(records, drive, ranking)
    metres = [_metres(record, drive, ranking) for record in records]
    known = [distance for distance in metres if distance is not None]
    mp = [max(record.counts[answer], 0) if (answer := record.answer(ranking)) is not None else 0 for record in records]
    partner = [max(record.counts[record.truth], 0) if record.counts else 0 for record in records]
    seconds = [record.seconds for record in records if record.seconds is not None]
    gap, gap_ci = _gap_closed(first, groups, ranking, seed)
    return {
        "method": first.method,
        "matcher": first.matcher,
        "ranking": ranking,
        "queries": len(records),
        "references": len(drive.references),
        "accuracy": rounded(right.mean()),
        "accuracy_ci": [rounded(bound) for bound in mean_interval(right, seed)],
        "accuracy_pm1": _share([o is not None and abs(o) <= 1 for o in off]) if drive.consecutive else None,
        **{f"accuracy_{m}m": _share([distance <= m for distance in known]) for m in WITHIN_M},
        "mp": rounded(statistics.mean(mp)),
        "mp_partner": rounded(statistics.mean(partner)),
        "gap_closed": gap,
        "gap_closed_ci": gap_ci,
        "seconds": rounded(statistics.median(seconds)) if seconds else None,
        "failures": [{"name": record.name, "why": record.failure} for record in records if record.failure],
    }


def _metres(record: DrivingRecord, drive: DrivingSet, ranking: str) -> float | None:
    """How far the answer's place is from the partner's; infinity without an answer, None where it is unknown."""
    partner = drive.references[record.truth]
    if partner.position_m is None:
        return None
    answer = record.answer(ranking)
    return float("inf") if answer is None else metres_apart(drive.references[answer], partner)


def _gap_closed(
    first: DrivingRecord, groups: dict[tuple[str, str], list[DrivingRecord]], ranking: str, seed: int
) -> tuple[float | None, list[float] | None]:
    """(gap_closed, its interval): queries drawn together for all three; draws without a gap tell nothing."""
    ends = [groups.get((method, first.matcher)) for method in (LOW, HIGH)]
    if first.method in (LOW, HIGH) or None in ends:
        return None, None
    by_name = [{record.name: record for record in own or []} for own in (*ends, groups[first.method, first.matcher])]
    names = [name for name in by_name[2] if all(name in own for own in by_name)]
    low, high, own = (hits([side[name] for name in names], ranking) for side in by_name)
    if not names or high.mean() == low.mean():
        return None, None
    shares = []
    for drawn in resamples(len(names), seed, _DRAWS):
        gap = high[drawn].mean(1) - low[drawn].mean(1)
        there = gap != 0
        shares.append((own[drawn].mean(1) - low[drawn].mean(1))[there] / gap[there])
    value = (own.mean() - low.mean()) / (high.mean() - low.mean())
    return rounded(value), [rounded(bound) for bound in percentiles(shares, 0.95)]


def _share(values: Sequence[bool]) -> float | None:
    return rounded(sum(values) / len(values)) if values else None
