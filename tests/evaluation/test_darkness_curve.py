"""The darkness curve: its points, what is measured at them, where a curve breaks down, the command."""

import csv
import json
import sys

import pytest
from matching_stubs import Brighten, KnownMatcher, contest, photos
from PIL import Image

from diffnav.darkness import DarknessModel
from diffnav.data.match_pairs.rot180 import Rot180Pairs
from diffnav.data.pair_source import PairSource
from diffnav.enhancers.input import Input
from diffnav.errors import UserError
from diffnav.evaluation.darkness_curve import breakdown_level, curve_conditions, curve_rows, flat_row, measure_curve
from diffnav.evaluation.darkness_curve_page import breakdown_table
from diffnav.evaluation.match_records import MatchRecord
from diffnav.evaluation.method_styles import KNOWN, method_styles
from diffnav.evaluation.records import RecordLog
from eval.darkness_curve import main


def make_pairs(darkness):
    return Rot180Pairs(PairSource(photos(2), darkness))


def test_the_points_of_three_curves():
    points = curve_conditions([1, 4], [0, 0.01], [1, 5], base_gamma=4, read_share=0.5, quality=90)
    assert [(point.axis, point.level) for point in points] == [
        ("gamma", 1), ("gamma", 4), ("noise", 0), ("noise", 0.01), ("blur_px", 1), ("blur_px", 5),
    ]  # fmt: skip
    assert points[0].darkness == DarknessModel((1, 1), (90, 90))
    assert points[3].darkness == DarknessModel((4, 4), (90, 90), (0.01, 0.01), (0.005, 0.005))
    assert points[5].darkness == DarknessModel((4, 4), (90, 90), blur_px=(5, 5))
    assert points[1].darkness == points[2].darkness == points[4].darkness


@pytest.mark.parametrize("levels", [[2, 1], [1, 1]])
def test_levels_must_rise(levels):
    with pytest.raises(UserError, match=r"curve\.noise must be levels that rise"):
        curve_conditions([1], levels, [1])


def test_every_point_has_its_records_and_equal_ones_are_measured_once():
    points = curve_conditions([2, 4], [0, 0.02], [1])
    enhancer = Brighten()
    fight = contest({"input": Input(), "a": enhancer}, {"m": KnownMatcher()})
    measured = measure_curve(points, make_pairs, fight, RecordLog(None, MatchRecord))
    # Three different darknesses of two photos, and the warm-up.
    assert enhancer.calls == 3 * 2 + 1
    assert [[(r.name, r.method) for r in own] for own in measured.records] == [
        [("p0", "input"), ("p0", "a"), ("p1", "input"), ("p1", "a")]
    ] * 5
    assert [own[0].gamma for own in measured.records] == [2, 4, 4, 4, 4]
    rows = curve_rows(points, measured.records)
    assert len(rows) == 5 * 2
    assert rows[2] == {
        "axis": "gamma", "level": 4, "method": "input", "matcher": "m", "correct": 8, "correct_ci": [8, 8], "mp": 10,
        "mp_ci": [10, 10], "precision": 0.8, "precision_ci": [0.8, 0.8], "n": 2,
    }  # fmt: skip
    assert flat_row(rows[2])["correct_low"] == flat_row(rows[2])["correct_high"] == 8


def test_where_a_curve_breaks_down():
    levels = [1, 2, 4, 8]
    assert breakdown_level(levels, [100, 80, 40, 0]) == 3.5
    assert breakdown_level(levels, [100, 80, 70, 50]) is None
    # It starts low and rises: what counts is where it falls for good.
    assert breakdown_level(levels, [10, 100, 50, 0]) == 4
    assert breakdown_level(levels, [0, 0, 0, 0]) is None


def test_the_table_of_breakdowns():
    curves = {"normal": (100, 100), "a": (90, 10), "b": (20, 30)}
    rows = [
        {"axis": "gamma", "level": level, "method": method, "matcher": "sift", "correct": values[k]}
        for method, values in curves.items()
        for k, level in enumerate((2, 6))
    ]
    # a falls from 90 to 10 between 2 and 6: to 45 at 2 + 4 * 45 / 80.
    assert breakdown_table(rows).splitlines()[2:] == [
        "| normal | > 6 (100) |", "| a      | 4.25 (90) |", "| b      |  > 6 (30) |",
    ]  # fmt: skip


def test_a_methods_style_is_the_same_in_every_plot():
    few, many = method_styles(["gamma_blind", "mine"]), method_styles(["input", "gamma_blind", "mine", "other"])
    assert few == {name: many[name] for name in few}
    assert len({tuple(sorted(style.items())) for style in many.values()}) == 4
    assert len(set(KNOWN.values())) == len(KNOWN)


def test_the_command(tmp_path, monkeypatch, capsys):
    out = tmp_path / "out"
    given = ["data=scenes", "data.photos.count=2", "data.photos.size=[64,96]", "workers=1", "matchers=[sift,orb]"]
    curve = ["curve={gamma: [2, 4], noise: [0, 0.05], blur_px: [1, 9]}", "always=[input,gamma_blind]", "enhancers=[]"]
    arguments = [*given, *curve, f"out={out}", f"cache={tmp_path / 'cache'}", "device=cpu"]
    for earlier in (0, 32):
        monkeypatch.setattr(sys, "argv", ["eval.darkness_curve", *arguments])
        main()
        assert f"24 points, {earlier} of their results from before, 3 plots" in capsys.readouterr().out
    content = json.loads((out / "darkness_curve.json").read_text())
    assert content["protocol"]["curve"]["gamma"] == [2, 4]
    assert "darkness" not in content["protocol"]
    with (out / "darkness_curve.csv").open() as file:
        table = list(csv.DictReader(file))
    assert len(table) == len(content["rows"]) == 24
    assert float(table[0]["correct_low"]) <= float(table[0]["correct"]) <= float(table[0]["correct_high"])
    page = (out / "darkness_curve.md").read_text()
    for axis in ("gamma", "noise", "blur_px"):
        assert f"(darkness_curve_{axis}.png)" in page
        with Image.open(out / f"darkness_curve_{axis}.png") as plot:
            assert min(plot.size) > 200
