"""The rows of Table 2 from hand-made records; areas and intervals against independent computations; the page."""

import math
import statistics

import numpy as np
import pytest

from diffnav.evaluation.auc_bootstrap import auc_difference, auc_interval
from diffnav.evaluation.homography_auc import homography_auc
from diffnav.evaluation.match_records import MatchRecord
from diffnav.evaluation.match_rows import matching_rows
from diffnav.evaluation.matching_figures import best_median_worst
from diffnav.evaluation.matching_page import correct_table, matching_page, sources_table

NAMES = ("a1", "a2", "b1")


def record(method, name, correct, mp, error_px=None, matcher="sift", **others):
    share = correct / max(mp, 1)
    labels = ("key", method, matcher, "rot180", name, name[0], 4.0, 40, 60)
    figures = (10, mp, correct, share, correct, share, others.pop("repeatability", 0.5), error_px)
    return MatchRecord(*labels, *figures, 0.2, 0.1, 0.05, 0.01, device="machine", **others)


def records():
    dark = [record("input", name, *figures) for name, figures in zip(NAMES, ((2, 10), (0, 0), (4, 5)), strict=True)]
    bright = [
        record("gamma_blind", name, *figures)
        for name, figures in zip(NAMES, ((20, 25, 0.5), (10, 10, 2.0), (30, 40, None)), strict=True)
    ]
    return [*dark, *bright, *(record("net", name, 7, 7, 4.0, "akaze") for name in NAMES)]


def test_means_over_all_pairs():
    dark, bright, net = matching_rows(records())
    assert [(row["method"], row["matcher"], row["n"]) for row in (dark, bright, net)] == [
        ("input", "sift", 3), ("gamma_blind", "sift", 3), ("net", "akaze", 3),
    ]  # fmt: skip
    assert (dark["mp"], dark["correct"]) == (5, 2)
    # 2 / 10, nothing of nothing, 4 / 5.
    assert dark["precision"] == pytest.approx((0.2 + 0 + 0.8) / 3, abs=1e-6)
    assert bright["correct"] == 20
    assert 10 <= bright["correct_ci"][0] <= 20 <= bright["correct_ci"][1] <= 30
    assert net["correct_ci"] == [7, 7]
    assert [bright[f"seconds_{step}"] for step in ("enhance", "detect", "match", "verify")] == [0.2, 0.1, 0.05, 0.01]
    assert bright["device"] == "machine"


def test_areas_of_the_corner_errors():
    """By hand at 3 px, errors .5, 2, none: from (0, 0) to (.5, 1/3), (2, 2/3), level to 3."""
    row = matching_rows(records())[1]
    area = 0.5 * (1 / 6) + 1.5 * (1 / 2) + 1 * (2 / 3)
    assert row["auc3"] == pytest.approx(area / 3, abs=1e-6)
    assert row["auc1"] == pytest.approx(0.5 * (1 / 6) + 0.5 / 3, abs=1e-6)
    assert matching_rows(records())[0]["auc5"] == 0
    assert row["auc3_ci"][0] <= row["auc3"] <= row["auc3_ci"][1]


def test_paired_differences_with_the_same_matcher():
    dark, bright, net = matching_rows(records())
    assert set(dark["versus"]) == {"gamma_blind"}
    assert set(bright["versus"]) == {"input"}
    assert net["versus"] == {}
    mean, low, high = bright["versus"]["input"]["correct"]
    assert (mean, low, high) == (18, 10, 26)
    assert dark["versus"]["gamma_blind"]["correct"] == [-18, -26, -10]
    assert bright["versus"]["input"]["auc3"][0] == bright["auc3"]


def test_pairs_that_one_of_two_lacks_are_not_compared():
    """gamma_oracle on a set of which one picture is really dark."""
    oracle = [record("gamma_oracle", name, 9, 9) for name in ("a2", "b1")]
    row = matching_rows([*records(), *oracle])[-1]
    assert row["n"] == 2
    assert row["versus"]["input"]["correct"][0] == statistics.fmean([9 - 0, 9 - 4])
    assert set(matching_rows([*records()[:3], record("x", "c1", 1, 1)])[-1]["versus"]) == set()


def test_sources_and_failures():
    every = [*records(), record("net", "b2", 0, 0, matcher="akaze", failure="out of memory", repeatability=None)]
    row = matching_rows(every)[-1]
    assert row["per_source"] == {
        "a": {"n": 2, "mp": 7, "correct": 7, "precision": 1},
        "b": {"n": 2, "mp": 3.5, "correct": 3.5, "precision": 0.5},
    }
    assert row["failures"] == [{"name": "b2", "why": "out of memory"}]
    assert row["repeatability"] == 0.5
    assert matching_rows([record("m", "a", 1, 1, repeatability=None)])[0]["repeatability"] is None


def independent_interval(statistic, count, seed=77, draws=4000):
    dice = np.random.default_rng(seed)
    values = sorted(statistic(dice.choice(count, count)) for _ in range(draws))
    return values[round(0.025 * draws)], values[round(0.975 * draws) - 1]


def test_intervals_of_areas_against_an_independent_bootstrap():
    dice = np.random.default_rng(1)
    ours = np.where(dice.random(40) < 0.7, dice.gamma(1.5, 1.5, 40), math.inf)
    theirs = np.where(dice.random(40) < 0.5, dice.gamma(2.0, 2.0, 40), math.inf)

    def area(errors):
        return homography_auc(errors.tolist(), [3])[0]

    assert auc_interval(ours, 3) == pytest.approx(independent_interval(lambda i: area(ours[i]), 40), abs=0.015)
    mean, low, high = auc_difference(ours, theirs, 3)
    assert mean == pytest.approx(area(ours) - area(theirs))
    expected = independent_interval(lambda i: area(ours[i]) - area(theirs[i]), 40)
    assert (low, high) == pytest.approx(expected, abs=0.015)
    assert auc_difference(ours, ours, 3) == (0, 0, 0)
    with pytest.raises(ValueError, match="equally many"):
        auc_difference(ours, theirs[:-1], 3)


def test_best_median_and_worst():
    ranked = best_median_worst([record("m", f"p{c}", c, 9) for c in (3, 9, 1, 5)])
    assert [ranked[label].correct for label in ("best", "median", "worst")] == [9, 5, 1]
    one = record("m", "p", 4, 9)
    assert best_median_worst([one]) == {"best": one, "median": one, "worst": one}


def test_the_page():
    rows = matching_rows(records())
    page = matching_page(rows, {"seed": 3}, ["x: it cannot"])
    assert page.startswith("# Matching: correct matches, pairs=rot180\n")
    first = page.split("\n## ")[0]
    assert correct_table(rows) in first
    assert "| gamma_blind | 20.0 [" in first
    assert "105.2" not in first
    assert "105.2" in page
    assert "Left out: x: it cannot." in page
    sift = page.split("## sift")[1].split("\n## ")[0]
    assert "over input" in sift
    assert "+18.0 [+10.0, +26.0]" in sift
    assert sources_table(rows[:2], "sift").splitlines()[2].startswith("| a    |   2 | 1.0 / 0.100 |")
    assert "- seed: `3`" in page
