"""A flight's clock: times that are missing, equal, set back, with and without zone."""

from datetime import UTC, timedelta

import pytest
from made_flights import START, expected_at, fix_at, flown, lost

from diffnav.navigation.fix import Fix
from diffnav.navigation.track import Motion, Track


def test_pictures_without_times_come_at_the_interval() -> None:
    track = Track(Motion(interval_s=2.0))
    for k in range(10):
        assert track.update(fix_at(20 * k, 0)).status == "fix"
    assert expected_at(track, None)[0] == pytest.approx((200, 0), abs=1)
    # A time at last: nothing says how long after.
    assert expected_at(track, 500)[0] == pytest.approx((200, 0), abs=1)


def test_a_time_that_is_missing_between_others_moves_the_clock_on() -> None:
    """At 10 m/s: pictures at 9, 10 (not told) and 15 seconds."""
    track = Track()
    flown(track, 10)
    assert track.update(fix_at(100, 0, None)).status == "fix"
    assert expected_at(track, 15)[0] == pytest.approx((150, 0), abs=2)
    assert track.update(fix_at(150, 0, 15)).status == "fix"


def test_pictures_of_one_second_lie_at_one_place() -> None:
    track = Track()
    flown(track, 10)
    assert expected_at(track, 9)[0] == pytest.approx((90, 0), abs=2)
    assert track.update(fix_at(91, 1, 9)).status == "fix"
    assert track.update(lost(9)).sigma_m == pytest.approx(3, abs=1)


def test_a_clock_that_was_set_back_is_followed() -> None:
    """An hour back: the flight goes on at the usual interval, then by the clock."""
    track = Track()
    flown(track, 10)
    for k in range(10, 15):
        assert track.update(fix_at(10 * k, 0, k - 3600)).status == "fix"
    assert expected_at(track, 18 - 3600)[0] == pytest.approx((180, 0), abs=3)


def test_times_with_and_without_zone_do_not_fail() -> None:
    track = Track()
    flown(track, 10)
    aware = (START + timedelta(hours=9)).replace(tzinfo=UTC)
    assert track.expected(aware).radius_m is not None
    for k, time in enumerate((aware, START + timedelta(seconds=11), aware + timedelta(seconds=2))):
        assert track.update(Fix("photo", "no_fix", time=time)).status == "coasted"
        assert track.expected(time).place is not None
        assert k < 3
