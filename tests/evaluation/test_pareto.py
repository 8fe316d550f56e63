"""PSNR against matches: hand-made points whose front is known, the page, the plot, and mistakes."""

import json
import sys
from pathlib import Path

import pytest
from PIL import Image

from diffnav.errors import UserError
from diffnav.evaluation.pareto import pareto_page, pareto_rows
from eval.pareto import main

POINTS = {"a": (20.0, 100.0), "b": (25.0, 90.0), "c": (24.0, 95.0), "d": (23.0, 80.0), "e": (25.0, 85.0)}


def evaluations() -> tuple[list[dict], list[dict]]:
    enhancement = [
        {"method": name, "psnr": psnr, "psnr_ci": [psnr - 1, psnr + 1], "ssim": 0.5}
        for name, (psnr, _) in POINTS.items()
    ]
    matching = [
        {"method": name, "matcher": matcher, "correct": correct, "correct_ci": [correct - 5, correct + 5]}
        for name, (_, correct) in [*POINTS.items(), ("normal", (0, 200.0))]
        for matcher in ("sift", "akaze")
    ]
    return enhancement, matching


def test_the_front_is_what_nobody_passes_in_both() -> None:
    rows = pareto_rows(*evaluations())
    assert len(rows) == 10, "normal has no PSNR and is left out"
    # e has as much PSNR as b, but not more: nobody has more of both.
    assert {row["method"] for row in rows if row["front"]} == {"a", "b", "c", "e"}


def test_the_page_marks_it() -> None:
    page = pareto_page(pareto_rows(*evaluations()), {"enhancement": "x.json"})
    lines = {line.split("|")[1].strip(): line for line in page.splitlines() if line.startswith("| ")}
    assert lines["a"].count("*") == 2
    assert "*" not in lines["d"]
    assert "20.00 [19.00, 21.00]" in lines["a"]
    assert "`x.json`" in page


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    names = ("enhancement", "matching")
    for name, rows in zip(names, evaluations(), strict=True):
        (tmp_path / f"{name}.json").write_text(json.dumps({"rows": rows}))
    files = [f"{name}={tmp_path / f'{name}.json'}" for name in names]
    arguments = ["eval.pareto", *files, f"out={tmp_path / 'out'}", "methods=[a,b]", "matchers=[sift]"]
    monkeypatch.setattr(sys, "argv", arguments)
    main()
    assert "2 points, 2 of them on the front" in capsys.readouterr().out
    with Image.open(tmp_path / "out" / "pareto.png") as plot:
        assert min(plot.size) > 300
    assert [row["method"] for row in json.loads((tmp_path / "out" / "pareto.json").read_text())["rows"]] == ["a", "b"]
    (tmp_path / "matching.json").write_text("[]")
    monkeypatch.setattr(sys, "argv", arguments)
    with pytest.raises(SystemExit):
        main()
    assert "matching.json: not the results of an evaluation" in capsys.readouterr().err


def test_evaluations_of_different_methods_are_refused() -> None:
    enhancement, matching = evaluations()
    with pytest.raises(UserError, match="share no method"):
        pareto_rows(enhancement[:1], [row for row in matching if row["method"] == "b"])
