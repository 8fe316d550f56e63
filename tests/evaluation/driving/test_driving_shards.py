"""Queries of eval.driving divided among processes: in turn, and at the same time as torchrun starts them."""

import csv
import re
import shutil
from pathlib import Path

import pytest

from eval import driving


def untimed(folder: Path) -> list[dict[str, str]]:
    """per_query.csv without seconds."""
    with (folder / "per_query.csv").open() as file:
        return [{key: value for key, value in line.items() if "seconds" not in key} for line in csv.DictReader(file)]


def test_shards_in_turn_are_the_whole(localise, summary, tmp_path: Path) -> None:
    localise(out=tmp_path / "whole")
    printed = localise(shard="[0,2]").out
    assert re.search(r"records-0-of-2\.jsonl: 4 answers; the other shards have 4 left", printed)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"records-0-of-2.jsonl"}
    printed = localise(shard="[1,2]").out
    assert "8 answers, 4 of them from before" in printed
    assert summary("out")["rows"] == summary("whole")["rows"]
    assert untimed(tmp_path / "out") == untimed(tmp_path / "whole")
    # Again, and undivided: nothing is left to do.
    assert "8 answers, 8 of them from before" in localise(shard="[0,2]").out
    assert "8 answers, 8 of them from before" in localise().out


def test_shards_at_the_same_time_write_the_tables(
    localise, summary, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As torchrun starts them: neither finds anything of the other when it begins."""
    localise(out=tmp_path / "whole")
    monkeypatch.setenv("WORLD_SIZE", "2")
    monkeypatch.setenv("RANK", "0")
    localise(out=tmp_path / "first")
    measure = driving.measure_drive

    def beside_another(*given, **settings):
        shutil.copy(tmp_path / "first" / "records-0-of-2.jsonl", tmp_path / "out")
        return measure(*given, **settings)

    (tmp_path / "out").mkdir()
    monkeypatch.setattr(driving, "measure_drive", beside_another)
    monkeypatch.setenv("RANK", "1")
    assert "8 answers, 4 of them from before" in localise().out
    assert summary()["rows"] == summary("whole")["rows"]
    assert (tmp_path / "out" / "records-1-of-2.jsonl").read_text().count("\n") == 4
