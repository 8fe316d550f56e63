"""Markdown, CSV and JSON files."""

import csv
import json
from pathlib import Path

import pytest

from diffnav.errors import UserError
from diffnav.evaluation.tables import markdown_table, write_csv, write_json


def test_markdown_lines_up_and_fills_gaps() -> None:
    table = markdown_table(["method", "dB"], [{"method": "input", "dB": "9.07"}, {"method": "ours"}])
    assert table.splitlines() == [
        "| method |   dB |",
        "| ------ | ---: |",
        "| input  | 9.07 |",
        "| ours   |      |",
    ]


def test_csv_keeps_every_digit_and_every_column(tmp_path: Path) -> None:
    value = 0.1 + 0.2
    write_csv(tmp_path / "new" / "t.csv", [{"a": 1, "b": value}, {"a": "x, y", "c": None}])
    with (tmp_path / "new" / "t.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["a", "b", "c"]
    assert float(rows[0]["b"]) == value
    assert (rows[1]["a"], rows[1]["b"], rows[1]["c"]) == ("x, y", "", "")


def test_json_has_no_nan(tmp_path: Path) -> None:
    write_json(tmp_path / "t.json", {"a": [1.5, None], "b": "ö"})
    assert json.loads((tmp_path / "t.json").read_text()) == {"a": [1.5, None], "b": "ö"}
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json(tmp_path / "t.json", {"a": float("nan")})
    assert json.loads((tmp_path / "t.json").read_text())["b"] == "ö"


def test_a_place_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="choose another out="):
        write_json(tmp_path / "file" / "t.json", {})
