"""The driving experiment as a Markdown page: Table 3, the paper's beside it, confusion among neighbours."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from diffnav.data.driving.driving_set import DrivingSet
from diffnav.evaluation.cells import duration, failure_lines, protocol_section, with_interval
from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.driving.rows import WITHIN_M, offsets
from diffnav.evaluation.tables import markdown_table

Row = Mapping[str, Any]

# Table 3 of the paper: (name of the row, accuracy, MP), its 1121 pairs, ORB and GMS.
_PAPER = (("low-light", 0.388, 47.52), ("enhanced", 0.727, 94.10), ("normal-light", 0.801, 118.71))
# Answers farther off than so many moments are counted together.
_NEAR = 3

_NOTES = """`Acc`: share of the queries answered with their partner, with its 95 % bootstrap interval; `+-1`: with it or
a neighbour; `2 m` and so on: within that distance of it. `MP`: mean matches with the answer, `with partner`: with the
right one. `gap closed`: (Acc - Acc of `input`) / (Acc of `normal` - Acc of `input`). `input`: the dark picture;
`normal`: the daylight one. Ranked by `matches`, as the paper does; or, among the references with the most matches, by
`inliers` of a fundamental matrix, or by matches that keep their `rows`, as partners of rectified cameras must. Seconds
are medians of one thread, from the dark picture to the answer, without verification."""


def driving_page(
    rows: Sequence[Row], records: Sequence[DrivingRecord], drive: DrivingSet, protocol: Mapping[str, Any]
) -> str:
    """The whole page; rows of `driving_rows`."""
    parts = ["# Driving: which picture of the other camera?", driving_table(rows), _NOTES]
    if any(row["matcher"].startswith("orb_gms") for row in rows):
        parts += ["The paper's Table 3, 1121 pairs of zpark: " + "; ".join(
            f"{name} + GMS Acc {accuracy:.3f}, MP {mp:.2f}" for name, accuracy, mp in _PAPER
        ) + "; gap closed .82."]  # fmt: skip
    if drive.consecutive:
        parts += ["## How many moments off", confusion_table(records, drive)]
    if failures := failure_sentences(rows):
        parts += ["## Failed", "\n".join(f"- {failure}" for failure in failures)]
    if drive.unmatched:
        parts += ["## Left out", "\n".join(f"- {sentence}" for sentence in drive.unmatched)]
    return "\n\n".join([*parts, protocol_section(protocol)]) + "\n"


def failure_sentences(rows: Sequence[Row]) -> list[str]:
    """One sentence per method and query that has no answer."""
    return failure_lines([{**row, "n": row["queries"]} for row in rows])


def driving_table(rows: Sequence[Row]) -> str:
    """One line per method, matcher and ranking."""
    metres = [limit for limit in WITHIN_M if any(row[f"accuracy_{limit}m"] is not None for row in rows)]
    near = [row["accuracy_pm1"] is not None for row in rows]
    columns = ["method", "matcher", "ranked by", "Acc", *(["+-1"] if any(near) else [])]
    columns += [*(f"{limit} m" for limit in metres), "MP", "with partner", "gap closed", "s", "n"]
    lines = [
        {
            "method": row["method"],
            "matcher": row["matcher"],
            "ranked by": row["ranking"],
            "Acc": with_interval(row["accuracy"], row["accuracy_ci"], 3),
            "+-1": _number(row["accuracy_pm1"], 3),
            **{f"{limit} m": _number(row[f"accuracy_{limit}m"], 3) for limit in metres},
            "MP": _number(row["mp"], 1),
            "with partner": _number(row["mp_partner"], 1),
            "gap closed": with_interval(row["gap_closed"], row["gap_closed_ci"], 2),
            "s": duration(row["seconds"]),
            "n": str(row["queries"]),
        }
        for row in rows
    ]
    return markdown_table(columns, [{column: line[column] for column in columns} for line in lines])


def confusion_table(records: Sequence[DrivingRecord], drive: DrivingSet) -> str:
    """How many answers, ranked by matches, lie so many moments after (+) or before (-) the partner."""
    columns = ["method", "matcher", f"< -{_NEAR}", *(f"{k:+d}" if k else "0" for k in range(-_NEAR, _NEAR + 1)),
               f"> +{_NEAR}", "other record", "none"]  # fmt: skip
    groups: dict[tuple[str, str], list[DrivingRecord]] = {}
    for record in records:
        groups.setdefault((record.method, record.matcher), []).append(record)
    lines = []
    for (method, matcher), own in groups.items():
        counts = dict.fromkeys(columns, 0)
        for offset in offsets(own, drive, "matches"):
            counts[_column(offset)] += 1
        lines.append({**{key: str(count) for key, count in counts.items()}, "method": method, "matcher": matcher})
    return markdown_table(columns, lines)


def _column(offset: float | None) -> str:
    if offset is None:
        return "none"
    if math.isinf(offset):
        return "other record"
    if abs(offset) > _NEAR:
        return f"> +{_NEAR}" if offset > 0 else f"< -{_NEAR}"
    return f"{int(offset):+d}" if offset else "0"


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
