"""What a navigation experiment leaves behind as tables: rows, every answer, the curves of integrity."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from diffnav.evaluation.navigation.integrity import integrity_curves, write_integrity_plot
from diffnav.evaluation.navigation.page import navigation_page
from diffnav.evaluation.navigation.records import NavigationRecord
from diffnav.evaluation.navigation.rows import navigation_rows
from diffnav.evaluation.tables import write_csv, write_json, write_text


def write_tables(out: Path, records: Sequence[NavigationRecord], protocol: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Write navigation.json and .md, per_query.csv, integrity.json and .png into `out`; the rows. Raises: UserError."""
    rows, curves = navigation_rows(records), integrity_curves(records)
    write_csv(out / "per_query.csv", [record.flat() for record in records])
    write_json(out / "navigation.json", {"rows": rows, "protocol": protocol})
    write_text(out / "navigation.md", navigation_page(rows, records, protocol))
    write_json(out / "integrity.json", {"curves": curves})
    write_integrity_plot(out / "integrity.png", curves)
    return rows
