"""The best split against every split tried by hand, and the area under the ROC against the rank statistic."""

import random
from itertools import pairwise

import pytest

from diffnav.errors import UserError
from diffnav.navigation.gates.threshold import fit_threshold, judge_threshold, roc


def accuracy(threshold, normal, dark):
    found = sum(value < threshold for value in dark) / len(dark)
    passed = sum(value >= threshold for value in normal) / len(normal)
    return (found + passed) / 2


def test_separate_numbers_are_split_midway():
    fitted = fit_threshold([8.0, 5.0, 9.0], [1.0, 2.0, 0.5])
    assert fitted.threshold == 3.5
    assert fitted.balanced_accuracy == 1
    assert (fitted.dark_passed, fitted.normal_enhanced) == (0, 0)
    assert (fitted.normal_count, fitted.dark_count) == (3, 3)
    assert fitted.auc == 1


def test_overlapping_numbers_by_hand():
    # Below 4.5: two of three dark ones and one of four normal ones, (2/3 + 3/4) / 2; below 2: 1/3 and none, 2/3;
    # below 8: all dark and three of four normal, 5/8; below 5.5 one more normal.
    fitted = fit_threshold([4.0, 5.0, 6.0, 9.0], [1.0, 3.0, 7.0])
    # (2/3 + 1) / 2 below 3.5 is better than all these.
    assert fitted.threshold == 3.5
    assert fitted.balanced_accuracy == pytest.approx(5 / 6)
    assert fitted.dark_passed == pytest.approx(1 / 3)
    assert fitted.normal_enhanced == 0
    judged = judge_threshold(4.5, [4.0, 5.0, 6.0, 9.0], [1.0, 3.0, 7.0])
    assert judged.normal_enhanced == pytest.approx(1 / 4)
    assert judged.balanced_accuracy == pytest.approx((2 / 3 + 3 / 4) / 2)


def test_of_equal_splits_the_widest_gap_wins_then_the_lowest():
    # Below 2, below 4 and below 6.5 each tell five of six rightly; the gap from 5 to 8 is the widest.
    assert fit_threshold([3.0, 8.0, 9.0], [1.0, 5.0]).threshold == 6.5
    assert fit_threshold([3.0, 7.0], [1.0, 5.0]).threshold == 2.0


@pytest.mark.parametrize("seed", range(20))
def test_no_other_split_is_better(seed):
    dice = random.Random(seed)
    normal = [dice.choice([round(dice.gauss(5, 3), 1), dice.gauss(5, 3)]) for _ in range(dice.randint(2, 30))] + [9.0]
    dark = [round(dice.gauss(2, 3), 1) for _ in range(dice.randint(2, 30))] + [-9.0]
    fitted = fit_threshold(normal, dark)
    values = sorted({*normal, *dark})
    tried = [accuracy((a + b) / 2, normal, dark) for a, b in pairwise(values)]
    assert fitted.balanced_accuracy == pytest.approx(max(tried))
    assert accuracy(fitted.threshold, normal, dark) == pytest.approx(fitted.balanced_accuracy)


def test_neighbouring_floats_are_told_apart():
    lower = 1.0
    upper = lower + 2**-52
    fitted = fit_threshold([upper], [lower])
    assert lower < fitted.threshold <= upper
    assert fitted.balanced_accuracy == 1


@pytest.mark.parametrize("seed", range(10))
def test_the_area_is_the_rank_statistic(seed):
    dice = random.Random(seed)
    normal = [dice.randint(0, 12) for _ in range(dice.randint(1, 25))]
    dark = [dice.randint(-5, 9) for _ in range(dice.randint(1, 25))]
    wins = sum((d < n) + 0.5 * (d == n) for d in dark for n in normal)
    assert roc(normal, dark).auc == pytest.approx(wins / (len(normal) * len(dark)))


def test_the_curve_runs_from_none_to_all():
    curve = roc([2.0, 4.0], [1.0, 2.0])
    assert curve.thresholds.tolist() == [1, 2, 4, float("inf")]
    assert curve.dark_enhanced.tolist() == [0, 0.5, 1, 1]
    assert curve.normal_enhanced.tolist() == [0, 0, 0.5, 1]


@pytest.mark.parametrize(("normal", "dark"), [([1.0, 2.0], [3.0, 4.0]), ([2.0], [2.0]), ([1.0, 1.0], [1.0])])
def test_no_split_better_than_chance_is_refused(normal, dark):
    with pytest.raises(UserError, match="no threshold tells the dark pictures"):
        fit_threshold(normal, dark)


@pytest.mark.parametrize(
    ("normal", "dark", "kind"), [([], [1.0], "normal"), ([1.0], [], "dark"), ([1.0], [float("nan")], "dark")]
)
def test_missing_numbers_are_named(normal, dark, kind):
    for measure in (fit_threshold, roc):
        with pytest.raises(UserError, match=f"one or more {kind} pictures"):
            measure(normal, dark)
