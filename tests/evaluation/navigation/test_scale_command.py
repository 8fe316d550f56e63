"""The command eval.navigation_scale, in processes of its own as users have it."""

import json
import sys
from pathlib import Path

import pytest
from PIL import Image

from eval.navigation_scale import main

pytest.importorskip("faiss", reason="FAISS, of the extra `scale`, is not installed")

SMALL = ["study.maps.tile=[128,160]", "study.maps.features=90", "study.maps.indexed=60", "study.maps.pool=8",
         "study.queries=2", "study.features=250", "study.threads=1"]  # fmt: skip


def run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, *arguments: str) -> None:
    paths = [f"out={tmp_path / 'out'}", f"paths.runs={tmp_path / 'runs'}"]
    monkeypatch.setattr(sys, "argv", ["eval.navigation_scale", *paths, *SMALL, *arguments])
    main()


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    run(monkeypatch, tmp_path, "counts=[20,9]", "study.exhaustive_to=9")
    assert "5 measurements made now, 0 before" in capsys.readouterr().out
    result = json.loads((tmp_path / "out" / "navigation_scale.json").read_text())
    modes = [(row["tiles"], row["mode"]) for row in result["rows"]]
    assert modes == [(9, "shortlist"), (9, "exhaustive"), (20, "shortlist")]
    assert all(row["peak_gb"] >= row["libraries_gb"] > 0 for row in result["rows"])
    assert set(result["targets"]) == {"seconds", "recall_loss"}
    facts = result["protocol"]
    assert facts["nearest_descriptor_of_another_place"]["tiles"] == 4
    assert "a real one of another place" in facts["simulated"]
    assert facts["maps"] == {"tile": [128, 160], "features": 90, "indexed": 60, "pool": 8, "seed": 0}
    assert facts["versions"]["faiss"][0].isdigit()
    assert str(tmp_path) not in json.dumps(result)
    page = (tmp_path / "out" / "navigation_scale.md").read_text()
    assert page.startswith("# Scale")
    with Image.open(tmp_path / "out" / "scale.png") as picture:
        assert picture.width > picture.height
    # A second run measures what is new alone.
    run(monkeypatch, tmp_path, "counts=[9]", "study.exhaustive_to=9")
    assert "0 measurements made now, 5 before" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("argument", "sentence"),
    [
        ("counts=[9,5]", "counts must be numbers of 9 or more, got [9, 5]: so many tiles are real"),
        ("counts=[a]", "counts cannot be 'a'; it is [9, 100, 1000, 10000, 100000] unless given"),
        ("counts=[10000000000]", "GB are needed; choose another cache= or fewer counts="),
        ("study.maps.indexed=91", "maps.indexed must be from 1 to maps.features=90, got 91"),
        ("study.search.tiles=0", "search.tiles must be 1 or more, got 0"),
    ],
)
def test_mistakes_are_one_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    argument: str,
    sentence: str,
) -> None:
    with pytest.raises(SystemExit) as ending:
        run(monkeypatch, tmp_path, argument)
    assert ending.value.code == 2
    assert sentence in capsys.readouterr().err
