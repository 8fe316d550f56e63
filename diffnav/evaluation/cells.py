"""How figures are written in the tables and pages of results."""

import json
from collections.abc import Mapping, Sequence
from typing import Any


def with_interval(value: float | None, interval: Sequence[float] | None, digits: int, sign: str = "-") -> str:
    """ "12.3 [11.0, 13.5]", and "-" for no value; sign "+" writes the plus of positive numbers."""
    if value is None or interval is None:
        return "-"
    low, high = (f"{bound:{sign}.{digits}f}" for bound in interval)
    return f"{value:{sign}.{digits}f} [{low}, {high}]"


def duration(seconds: float | None) -> str:
    """Seconds with three digits; less than a millisecond is not told apart."""
    if seconds is None:
        return "-"
    return f"{seconds:.3g}" if seconds >= 0.001 else "< .001"


def failure_lines(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """One sentence per method and picture that failed, one in all for a method that failed on every picture."""
    lines = []
    for row in rows:
        failures = row["failures"]
        if failures and row["n"] in (0, len(failures)):
            lines.append(f"{row['method']} on all {len(failures)}: {failures[0]['why']}")
        else:
            lines += [f"{row['method']} on {one['name']}: {one['why']}" for one in failures]
    # A method's failure is that of its rows with every matcher.
    return list(dict.fromkeys(lines))


def protocol_section(protocol: Mapping[str, Any]) -> str:
    """The section "Protocol": one line per fact."""
    facts = (f"- {name}: `{json.dumps(value, ensure_ascii=False)}`" for name, value in protocol.items())
    return "## Protocol\n\n" + "\n".join(facts)
