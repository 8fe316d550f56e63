"""Tables as Markdown, CSV and JSON; every file appears whole or not at all."""

import csv
import io
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from diffnav.errors import UserError


def markdown_table(columns: Sequence[str], rows: Sequence[Mapping[str, str]]) -> str:
    """A Markdown table of ready-made strings; the first column to the left, the others to the right; "" if missing."""
    widths = [max(len(column), *(len(row.get(column, "")) for row in rows), 3) for column in columns]

    def line(cells: Sequence[str]) -> str:
        padded = [
            cell.ljust(width) if index == 0 else cell.rjust(width)
            for index, (cell, width) in enumerate(zip(cells, widths, strict=True))
        ]
        return f"| {' | '.join(padded)} |"

    rule = [("-" * width) if index == 0 else "-" * (width - 1) + ":" for index, width in enumerate(widths)]
    body = [line([row.get(column, "") for column in columns]) for row in rows]
    return "\n".join([line(columns), line(rule), *body])


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write plain values; numbers that are not finite are refused, for JSON has none. Raises: UserError."""
    write_text(path, json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n")


def write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write one line per row; the columns are all keys, in the order of their first appearance. Raises: UserError."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: repr(v) if isinstance(v, float) else v for key, v in row.items()} for row in rows)
    write_text(path, text.getvalue())


def write_text(path: Path, text: str) -> None:
    """Write a text file in a folder that is made if needed. Raises: UserError."""
    aside = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        aside.write_text(text, encoding="utf-8")
        os.replace(aside, path)
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error.strerror or error}); choose another out=") from None
