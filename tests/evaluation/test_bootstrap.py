"""The bootstrap against an independent computation and against what an interval promises."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diffnav.evaluation.bootstrap import mean_interval, paired_difference


def independent(values: list[float], seed: int, draws: int, level: float) -> tuple[float, float]:
    """Resample by multinomial counts, one draw at a time, and cut the sorted means."""
    dice = np.random.default_rng(seed)
    n = len(values)
    means = sorted(dice.multinomial(n, [1 / n] * n) @ np.array(values) / n for _ in range(draws))
    tail = (1 - level) / 2
    return means[round(tail * draws)], means[round((1 - tail) * draws) - 1]


def test_equals_an_independent_computation() -> None:
    values = np.random.default_rng(5).gamma(2.0, 3.0, 40).tolist()
    ours = mean_interval(values, draws=20_000)
    theirs = independent(values, 99, 20_000, 0.95)
    assert ours == pytest.approx(theirs, abs=0.05)
    assert ours[0] < np.mean(values) < ours[1]


def test_approaches_the_normal_interval_on_many_values() -> None:
    values = np.random.default_rng(6).normal(10, 2, 4_000)
    half = 1.959964 * values.std() / np.sqrt(len(values))
    low, high = mean_interval(values)
    assert (low, high) == pytest.approx((values.mean() - half, values.mean() + half), abs=0.05 * half)


def test_a_95_percent_interval_holds_the_truth_about_95_times_in_100() -> None:
    held = 0
    for trial in range(400):
        values = np.random.default_rng(trial).normal(0, 1, 40)
        low, high = mean_interval(values, seed=trial, draws=1_000)
        held += low <= 0 <= high
    # The percentile interval is a little narrow at n = 40; three standard errors of 400 trials either way.
    assert 0.90 <= held / 400 <= 0.98


def test_a_wider_level_is_a_wider_interval() -> None:
    values = np.random.default_rng(7).normal(0, 1, 30)
    low90, high90 = mean_interval(values, level=0.90)
    low99, high99 = mean_interval(values, level=0.99)
    assert low99 < low90 < high90 < high99


def test_seeds_repeat_and_differ() -> None:
    values = np.random.default_rng(8).normal(0, 1, 30)
    assert mean_interval(values, seed=3) == mean_interval(values, seed=3)
    assert mean_interval(values, seed=3) != mean_interval(values, seed=4)


def test_portions_change_nothing_but_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    values = np.random.default_rng(9).normal(0, 1, 30)
    whole = mean_interval(values, draws=1_000)
    monkeypatch.setattr("diffnav.evaluation.bootstrap._PORTION", 70)
    assert mean_interval(values, draws=1_000) == pytest.approx(whole)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-100, 100), min_size=1, max_size=20), st.floats(-50, 50))
def test_the_interval_moves_with_the_values(values: list[float], shift: float) -> None:
    low, high = mean_interval(values, draws=200)
    assert min(values) - 1e-9 <= low <= high <= max(values) + 1e-9
    moved = mean_interval([v + shift for v in values], draws=200)
    assert moved == pytest.approx((low + shift, high + shift), abs=1e-6)


def test_one_value_has_no_width() -> None:
    assert mean_interval([4.5]) == (4.5, 4.5)


def test_pairing_removes_what_the_images_share() -> None:
    """A constant gain over very different images: no doubt about the difference, much about the means."""
    hard = np.random.default_rng(10).normal(20, 5, 30)
    mean, low, high = paired_difference(hard + 1.5, hard)
    assert (mean, low, high) == pytest.approx((1.5, 1.5, 1.5))
    wide = mean_interval(hard)
    assert wide[1] - wide[0] > 2


@pytest.mark.parametrize("values", [[], [1.0, float("nan")], [float("inf")]])
def test_values_that_have_no_mean_are_refused(values: list[float]) -> None:
    with pytest.raises(ValueError, match="finite"):
        mean_interval(values)


def test_unpaired_values_are_refused() -> None:
    with pytest.raises(ValueError, match="equally many"):
        paired_difference([1.0, 2.0], [1.0])
