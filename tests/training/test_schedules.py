"""The schedules against tables worked out by hand."""

import pytest

from diffnav.errors import UserError
from diffnav.training.schedules import Constant, OneCycle

# cos(45 deg), from a table.
HALF_ROOT_2 = 0.7071067811865476


def test_onecycle_follows_the_table() -> None:
    """8 steps, warm-up of 3, then cosines of 0, 45, 90, 135 and 180 degrees between 1 and .2.

    Warm-up: 1/3, 2/3, 3/3. Descent: .2 + .8 (1 + cos) / 2, that is .6 + .4 cos.
    """
    expected = [1 / 3, 2 / 3, 1, 1, 0.6 + 0.4 * HALF_ROOT_2, 0.6, 0.6 - 0.4 * HALF_ROOT_2, 0.2]
    schedule = OneCycle(warmup=0.375, final=0.2)
    assert [schedule.factor(step, 8) for step in range(8)] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("steps", [1, 2, 3, 10, 999])
@pytest.mark.parametrize("warmup", [0.0, 0.1, 1.0])
def test_onecycle_stays_in_range_and_reaches_its_peak(steps: int, warmup: float) -> None:
    factors = [OneCycle(warmup, 0.01).factor(step, steps) for step in range(steps)]
    assert min(factors) > 0
    assert max(factors) == 1
    if steps > 2 and warmup < 1:
        assert factors[-1] == pytest.approx(0.01)


def test_constant_is_one_and_alone_takes_more_steps() -> None:
    assert [Constant().factor(step, 5) for step in range(5)] == [1.0] * 5
    assert Constant().extendable
    assert not OneCycle().extendable


@pytest.mark.parametrize("setting", [{"warmup": 10}, {"final": -0.1}])
def test_shares_outside_0_to_1_are_refused_by_name(setting: dict) -> None:
    with pytest.raises(UserError, match=f"schedule.{next(iter(setting))} must lie between 0 and 1"):
        OneCycle(**setting)
