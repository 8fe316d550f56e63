"""The navigation experiment as a Markdown page."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from diffnav.evaluation.cells import duration, protocol_section
from diffnav.evaluation.navigation.headings import HEADING_M, heading_table
from diffnav.evaluation.navigation.records import NavigationRecord
from diffnav.evaluation.navigation.rows import FALSE_M, RECALL_M
from diffnav.evaluation.tables import markdown_table

Row = Mapping[str, Any]

_NOTES = f"""`fixes`: queries answered with a place; `@5 m` and so on: share of the queries with truth answered within;
`false`: fixes farther than {FALSE_M:.0f} m from the truth; `off map`: fixes of pictures that no map shows; `wrong`: the
two together as a share of all queries, upper end of its 95 % interval (Wilson). `input`: as taken; `normal`: the
daylight picture, the upper bound; others: enhanced where the gate says so."""


def navigation_page(rows: Sequence[Row], records: Sequence[NavigationRecord], protocol: Mapping[str, Any]) -> str:
    """The whole page; rows of `navigation_rows`."""
    parts = ["# Navigation: where the pictures were taken", navigation_table(rows), _NOTES]
    if headings := heading_table(records):
        parts += [f"## Found within {HEADING_M} m, by the query's heading", headings]
    if silent := _reasons(records):
        parts += ["## Why there was no fix", silent]
    return "\n\n".join([*parts, protocol_section(protocol)]) + "\n"


def navigation_table(rows: Sequence[Row]) -> str:
    """One line per method, search and condition."""
    recall = [f"@{limit} m" for limit in RECALL_M]
    columns = ["method", "matcher", "mode", "light", "queries", "fixes", *recall, "median, m", "p90, m", "false",
               "off map", "wrong", "s"]  # fmt: skip
    return markdown_table(columns, [_line(row) for row in rows])


def _line(row: Row) -> dict[str, str]:
    off_map = f"{row['offmap_fixes']} of {row['offmap_queries']}" if row["offmap_queries"] else "-"
    return {
        "method": row["method"],
        "matcher": row["matcher"],
        "mode": row["mode"],
        "light": row["condition"],
        "queries": str(row["queries"]),
        "fixes": str(row["fixes"]),
        **{f"@{limit} m": _number(row[f"recall_{limit}m"], 3) for limit in RECALL_M},
        "median, m": _number(row["median_m"], 2),
        "p90, m": _number(row["p90_m"], 2),
        "false": str(row["false_fixes"]),
        "off map": off_map,
        "wrong": "-" if row["false_rate_upper"] is None else f"{row['false_rate_upper']:.2%}",
        "s": duration(row["seconds"]),
    }


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _reasons(records: Sequence[NavigationRecord]) -> str:
    """How often each kind of reason was given for pictures that a map shows, by row."""
    lines = []
    groups: dict[tuple[str, ...], Counter[str]] = {}
    for record in records:
        if record.on_map and not record.is_fix:
            label: tuple[str, ...] = (record.method, record.matcher, record.mode, record.condition)
            groups.setdefault(label, Counter()).update(_kind(reason) for reason in record.answer["reasons"])
    for row, counts in groups.items():
        told = "; ".join(f"{count} x {kind}" for kind, count in counts.most_common(5))
        lines.append(f"- {', '.join(row)}: {told}")
    return "\n".join(lines)


def _kind(reason: str) -> str:
    """A reason without its numbers."""
    return " ".join("N" if any(letter.isdigit() for letter in word) else word for word in reason.split())
