"""From per-pair records to the rows of Table 2: one per method and matcher, with intervals and paired differences."""

import math
import statistics
from collections.abc import Mapping, Sequence

from diffnav.evaluation.aggregate import Row, difference, mean_with_interval, means_by_source, median, rounded
from diffnav.evaluation.auc_bootstrap import auc_difference, auc_interval
from diffnav.evaluation.homography_auc import homography_auc
from diffnav.evaluation.match_records import MatchRecord
from diffnav.evaluation.seeds import seed_rows

# Means over the pairs, of which a row has the bootstrap interval as well.
SCORES = ("mp", "correct", "precision", "inliers", "inlier_ratio")
# What is compared pair by pair with the reference methods.
COMPARED = ("mp", "correct", "precision")
AUC_PX = (1, 3, 5)
SECONDS = ("seconds_enhance", "seconds_detect", "seconds_match", "seconds_verify")


def matching_rows(
    records: Sequence[MatchRecord], references: Sequence[str] = ("input", "gamma_blind"), seed: int = 0
) -> list[Row]:
    """One plain row per method and matcher, in the order of their first records, ready for JSON.

    method, matcher, pairs; means over `n` pairs of mp, correct, precision, inliers, inlier_ratio (failures and pairs
    without a match count, with 0) and keypoints, repeatability (of the pairs that have one); auc1, auc3, auc5: of the
    corner error in px; *_ci: 95 % bootstrap intervals; seconds_*: medians; failures: which pairs and why;
    per_source: means of each site; versus: for each of the methods `references` the paired differences [mean, low,
    high] of mp, correct, precision and auc3, with the same matcher on the same pairs.
    """
    groups: dict[tuple[str, str], list[MatchRecord]] = {}
    for record in records:
        groups.setdefault((record.method, record.matcher), []).append(record)
    rows = []
    for (method, matcher), own in groups.items():
        others = {name: groups.get((name, matcher), []) for name in references if name != method}
        rows.append(_row(own, {name: met for name, met in others.items() if _common(own, met)}, seed))
    return rows


def compare_seeds(
    records: Sequence[MatchRecord], groups: Mapping[str, Sequence[str]], controls: Mapping[str, str], seed: int = 0
) -> dict[str, list[Row]]:
    """Matcher -> `seed_rows` of correct matches, failures counting with 0; nothing without groups."""
    if not groups:
        return {}
    values: dict[str, dict[str, dict[str, float]]] = {}
    for record in records:
        values.setdefault(record.matcher, {}).setdefault(record.method, {})[record.name] = record.correct
    return {matcher: seed_rows(own, groups, controls, seed=seed) for matcher, own in values.items()}


def corner_errors_px(records: Sequence[MatchRecord]) -> list[float]:
    """Each pair's corner error, infinite without a homography."""
    return [math.inf if r.corner_error_px is None else r.corner_error_px for r in records]


def _row(records: Sequence[MatchRecord], rivals: Mapping[str, Sequence[MatchRecord]], seed: int) -> Row:
    first = records[0]
    row: Row = {"method": first.method, "matcher": first.matcher, "pairs": first.pairs, "n": len(records)}
    for score in SCORES:
        row |= mean_with_interval(score, [getattr(r, score) for r in records], seed)
    row["keypoints"] = rounded(statistics.fmean(r.keypoints for r in records))
    row |= mean_with_interval("repeatability", [r.repeatability for r in records if r.repeatability is not None], seed)
    errors_px = corner_errors_px(records)
    for threshold_px, area in zip(AUC_PX, homography_auc(errors_px, AUC_PX), strict=True):
        interval = auc_interval(errors_px, threshold_px, seed)
        row |= {f"auc{threshold_px}": rounded(area), f"auc{threshold_px}_ci": [rounded(bound) for bound in interval]}
    return {
        **row,
        **{name: median([getattr(r, name) for r in records]) for name in SECONDS},
        "device": "; ".join(sorted({r.device for r in records if r.device})),
        "failures": [{"name": r.name, "why": r.failure} for r in records if r.failure],
        "per_source": means_by_source(records, COMPARED),
        "versus": {name: _versus(records, own, seed) for name, own in rivals.items()},
    }


def _versus(records: Sequence[MatchRecord], rivals: Sequence[MatchRecord], seed: int) -> dict[str, list[float]]:
    ours, theirs = zip(*_common(records, rivals), strict=True)
    differences = {
        score: difference([getattr(r, score) for r in ours], [getattr(r, score) for r in theirs], seed)
        for score in COMPARED
    }
    area = auc_difference(corner_errors_px(ours), corner_errors_px(theirs), 3, seed)
    return {**differences, "auc3": [rounded(value) for value in area]}


def _common(records: Sequence[MatchRecord], rivals: Sequence[MatchRecord]) -> list[tuple[MatchRecord, MatchRecord]]:
    """The records of the pairs that both have."""
    by_name = {r.name: r for r in rivals}
    return [(r, by_name[r.name]) for r in records if r.name in by_name]
