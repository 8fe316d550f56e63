"""Tables of pictures and their coordinates (CSV, TXT): columns found by name, cells with the line they stand in."""

import csv
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from diffnav.errors import UserError

TABLE_SUFFIXES = frozenset({".csv", ".txt", ".tsv"})
# Bytes of a first line that are looked at where any text file may lie beside photos.
_LONGEST_HEADER = 10_000
_SYNONYMS = (("longitude", "lon"), ("latitude", "lat"), ("long", "lon"), ("upper", "top"), ("lower", "bottom"))


@dataclass(frozen=True)
class Table:
    """The cells of a text file, the first line apart as `header`; rows are (line number from 1, cells)."""

    path: Path
    header: list[str]
    rows: list[tuple[int, list[str]]]
    delimiter: str

    def column(self, names: Sequence[str]) -> int | None:
        """The position of the first of these names (as `plain_name` writes them) that the header has."""
        header = [plain_name(cell) for cell in self.header]
        return next((header.index(name) for name in names if name in header), None)

    def columns(self, names: Mapping[str, Sequence[str]]) -> dict[str, int]:
        """The positions of those of the named columns that the header has."""
        found = {role: self.column(choices) for role, choices in names.items()}
        return {role: position for role, position in found.items() if position is not None}

    def require_header_apart(self) -> None:
        """Raises UserError if the header and the first row stand on one line (wildnav's map.csv has been seen so)."""
        values = [cell for cell in self.header if self.number(cell) is not None]
        if values:
            raise UserError(
                f"{self.path}: its first line holds numbers ({values[0]}) beside column names, so header and first "
                "row are glued together; put a line break between them"
            )

    def number(self, cell: str) -> float | None:
        """The finite number in a cell, None if it is no number; 60,25 is one where semicolons part the cells."""
        try:
            value = float(cell.replace(",", ".") if self.delimiter == ";" else cell)
        except ValueError:
            return None
        return value if math.isfinite(value) else None


def read_table(path: Path, first_line_only: bool = False) -> Table:
    """The table in a text file whose cells are parted by commas, semicolons, tabs or blanks; empty lines are skipped.

    Names may be quoted; blanks around cells do not count. Raises: UserError if the file cannot be read.
    """
    try:
        with path.open("rb") as file:
            raw = file.read(_LONGEST_HEADER if first_line_only else -1)
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror})") from None
    encoding = "utf-16" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    lines = [line.strip("\r\n ") for line in raw.decode(encoding, errors="replace").splitlines()]
    lines = lines[:1] if first_line_only else lines
    first = next((line for line in lines if line), "")
    delimiter = max(",;\t", key=first.count)
    delimiter = delimiter if delimiter in first else " "
    cells = []
    for number, line in enumerate(lines, 1):
        try:
            row = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
        except csv.Error as error:
            raise UserError(f"{path} line {number}: is no line of a table ({error}); save it as CSV in UTF-8") from None
        if any(row):
            cells.append((number, [cell.strip() for cell in row]))
    header = cells[0][1] if cells else []
    return Table(path, header, cells[1:], delimiter)


def plain_name(text: str) -> str:
    """A column's name without case, blanks and signs, with lat and lon short: `Top_left_long` -> `topleftlon`."""
    plain = re.sub("[^a-z0-9]", "", text.lower())
    for word, short in _SYNONYMS:
        plain = plain.replace(word, short)
    return plain
