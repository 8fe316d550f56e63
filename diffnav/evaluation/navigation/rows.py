"""From answers to the rows of the navigation table: availability, recall, errors, false fixes."""

import math
import statistics
from collections.abc import Sequence
from typing import Any

from diffnav.evaluation.aggregate import rounded
from diffnav.evaluation.navigation.records import NavigationRecord

# A fix farther from the truth is a false one.
FALSE_M = 50.0
RECALL_M = (5, 10, 25, 50)
# Of the normal distribution: 95 % lie within.
_Z = 1.959964


def navigation_rows(records: Sequence[NavigationRecord]) -> list[dict[str, Any]]:
    """One plain row per method, matcher, mode and condition, in the order of their first records.

    queries: on the map; fixes, availability: those answered with a place, and their share. recall_5m ... 50m: share of
    the queries with truth that were answered within; median_m, p90_m: error of the fixes. false_fixes: farther than
    50 m from the truth; false_of_fixes_upper: of their share of the fixes that can be judged, the Wilson 95 % bound.
    offmap_queries, offmap_fixes: pictures of places that no map shows, and answers to them; offmap_rate_upper: of that
    share, the bound. false_rate, false_rate_upper: both kinds of wrong fixes among all queries with truth or off the
    map, with its bound. seconds: median per query that could be used. Figures that do not exist are None.
    """
    groups: dict[tuple[str, str, str, str], list[NavigationRecord]] = {}
    for record in records:
        groups.setdefault((record.method, record.matcher, record.mode, record.condition), []).append(record)
    return [_row(own) for own in groups.values()]


def wilson_upper(count: int, of: int) -> float | None:
    """Upper end of the two-sided 95 % interval of a share; None of nothing. Source: Wilson 1927."""
    if of == 0:
        return None
    share, square = count / of, _Z**2
    middle = share + square / (2 * of)
    return (middle + _Z * math.sqrt(share * (1 - share) / of + square / (4 * of**2))) / (1 + square / of)


def _row(records: Sequence[NavigationRecord]) -> dict[str, Any]:
    first = records[0]
    inside, outside = [r for r in records if r.on_map], [r for r in records if not r.on_map]
    fixes = [r for r in inside if r.is_fix]
    errors_m = sorted(r.error_m for r in fixes if r.error_m is not None)
    false_fixes = sum(error > FALSE_M for error in errors_m)
    offmap_fixes = sum(r.is_fix for r in outside)
    judged = sum(r.has_truth for r in inside)
    wrong, asked = false_fixes + offmap_fixes, judged + len(outside)
    return {
        "method": first.method,
        "matcher": first.matcher,
        "mode": first.mode,
        "condition": first.condition,
        "queries": len(inside),
        "fixes": len(fixes),
        "availability": _share(len(fixes), len(inside)),
        **{f"recall_{limit}m": _share(sum(e <= limit for e in errors_m), judged) for limit in RECALL_M},
        "median_m": rounded(statistics.median(errors_m)) if errors_m else None,
        "p90_m": rounded(_quantile(errors_m, 0.9)) if errors_m else None,
        "false_fixes": false_fixes,
        "false_of_fixes_upper": wilson_upper(false_fixes, len(errors_m)),
        "offmap_queries": len(outside),
        "offmap_fixes": offmap_fixes,
        "offmap_rate_upper": wilson_upper(offmap_fixes, len(outside)),
        "false_rate": _share(wrong, asked),
        "false_rate_upper": wilson_upper(wrong, asked),
        "heading_median_deg": _median([abs(r.heading_error_deg) for r in fixes if r.heading_error_deg is not None]),
        "sigma_median_m": _median([r.answer["sigma_m"] for r in fixes if r.answer["sigma_m"] is not None]),
        "seconds": _median([r.seconds for r in records if r.is_usable]),
    }


def _quantile(ordered: Sequence[float], share: float) -> float:
    """The smallest value that at least this share does not exceed."""
    return ordered[max(math.ceil(share * len(ordered)), 1) - 1]


def _median(values: Sequence[float]) -> float | None:
    return rounded(statistics.median(values)) if values else None


def _share(count: int, of: int) -> float | None:
    return rounded(count / of) if of else None
