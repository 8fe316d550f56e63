import warnings
from pathlib import Path

import pytest
from navigation_stubs import answer
from PIL import Image

from diffnav.evaluation.navigation.integrity import integrity_curves, write_integrity_plot

RECORDS = [
    answer("a", inliers=15),
    answer("b", inliers=18),
    answer("c", inliers=30),
    answer("d", error_m=80, inliers=16),
    answer("e", "no_fix", inliers=14),
    answer("f", truth=None, inliers=17),
    answer("g", on_map=False, inliers=16),
    answer("h", "no_fix", on_map=False, inliers=40),
]


def test_a_curve_by_hand():
    (curve,) = integrity_curves(RECORDS)
    assert [curve[key] for key in ("method", "matcher", "mode", "condition")] == ["net", "sift", "shortlist", "day"]
    points = {point["min_inliers"]: point for point in curve["points"]}
    assert list(points) == list(range(15, 61))
    # Six on the map; five of them with truth, two off it: seven can be judged.
    shown = {least: (round(6 * points[least]["availability"]), points[least]["wrong"]) for least in points}
    assert {least: shown[least] for least in (15, 16, 17, 18, 19, 30, 31, 60)} == {
        15: (5, 2), 16: (4, 2), 17: (3, 0), 18: (2, 0), 19: (1, 0), 30: (1, 0), 31: (0, 0), 60: (0, 0),
    }  # fmt: skip
    assert {point["asked"] for point in points.values()} == {7}
    # Wilson's upper bound of 0 of n is z^2 / (n + z^2).
    assert points[20]["wrong_upper"] == pytest.approx(1.959964**2 / (7 + 1.959964**2))
    bounds = [point["wrong_upper"] for point in curve["points"]]
    assert bounds == sorted(bounds, reverse=True)


def test_a_curve_begins_where_fixes_begin():
    (curve,) = integrity_curves([answer(inliers=75)])
    assert [point["min_inliers"] for point in curve["points"]] == [75]


def test_rows_apart_and_those_without_a_fix_left_out():
    day, dark = ("net", "sift", "shortlist", "day"), ("net", "sift", "shortlist", "dark")
    silent, dense = ("input", "sift", "shortlist", "dark"), ("net", "gradients", "correlation", "day")
    records = [answer("a", labels=day), answer("a", labels=dark), answer("a", "no_fix", labels=silent)]
    records.append(answer("a", labels=dense, inliers=0))
    assert [curve["condition"] for curve in integrity_curves(records)] == ["day", "dark"]


def test_figures_that_do_not_exist_are_none():
    (curve,) = integrity_curves([answer("a", truth=None)])
    assert {(point["availability"], point["wrong_upper"]) for point in curve["points"]} == {(1.0, None), (0.0, None)}
    (curve,) = integrity_curves([answer("a", on_map=False)])
    assert {point["availability"] for point in curve["points"]} == {None}


@pytest.mark.parametrize(
    "records", [RECORDS, [], [answer("a", "no_fix")], [answer("a", truth=None)], [answer("a", on_map=False)]]
)
def test_the_plot_is_drawn_whatever_there_is(records: list, tmp_path: Path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        write_integrity_plot(tmp_path / "new" / "integrity.png", integrity_curves(records))
    with Image.open(tmp_path / "new" / "integrity.png") as plot:
        assert min(plot.size) > 400
