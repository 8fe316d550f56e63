"""A flight's fixes one after the other: jumps rejected, gaps bridged."""

import math
from datetime import timedelta

import numpy as np
import pytest
from made_flights import START, expected_at, fix_at, flown, lost
from made_maps import ORIGIN, metres_from

from diffnav.errors import UserError
from diffnav.navigation.prior import NOTHING
from diffnav.navigation.track import Motion, Track


def test_right_fixes_stay_as_they_are() -> None:
    track = Track()
    given = [fix_at(10 * k, 3 * k, k) for k in range(10)]
    assert [track.update(fix) for fix in given] == given


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_filter_is_nearer_to_the_truth_than_the_fixes(seed: int) -> None:
    """100 fixes of a straight flight, each off by 8 m along each axis: the state after each against the fix."""
    track = Track(Motion(acceleration_m_s2=0.3))
    dice = np.random.default_rng(seed)
    raw, filtered = [], []
    for k in range(100):
        truth = np.array([15.0 * k, -4.0 * k])
        fix = fix_at(*(truth + dice.normal(0, 8, 2)), seconds=k, sigma_m=8.0)
        assert track.update(fix) == fix
        (east, north), _ = expected_at(track, k)
        assert fix.place is not None
        raw.append(np.linalg.norm(metres_from(ORIGIN, fix.place) - truth))
        filtered.append(np.linalg.norm([east, north] - truth))
    assert np.mean(filtered[10:]) < 0.65 * np.mean(raw[10:])
    # And it knows where the next one will lie.
    (east, north), radius_m = expected_at(track, 100)
    off_m = math.dist((east, north), (1500, -400))
    assert off_m < radius_m / 2
    assert radius_m < 60


def test_the_filter_is_kalmans() -> None:
    """Along each axis alone, as scalars: prediction and correction written out, without matrices."""
    motion = Motion(speed_m_s=20.0, acceleration_m_s2=2.0, floor_m=3.0)
    track = Track(motion)
    measured = [(0.0, 0.0), (11.0, 4.0), (19.0, 9.0), (32.0, 11.0)]
    times = [0.0, 1.0, 2.5, 3.0]
    variance = 1.0**2 + 3.0**2
    states = [[0.0, 0.0], [0.0, 0.0]]
    p_xx, p_xv, p_vv = variance, 0.0, 400.0
    for k, (point, now) in enumerate(zip(measured, times, strict=True)):
        track.update(fix_at(*point, now))
        if k == 0:
            continue
        t = now - times[k - 1]
        p_xx, p_xv, p_vv = (
            p_xx + 2 * t * p_xv + t * t * p_vv + 4 * t**4 / 4,
            p_xv + t * p_vv + 4 * t**3 / 2,
            p_vv + 4 * t**2,
        )
        gain_x, gain_v = p_xx / (p_xx + variance), p_xv / (p_xx + variance)
        for state, value in zip(states, point, strict=True):
            state[0] += t * state[1]
            innovation = value - state[0]
            state[0] += gain_x * innovation
            state[1] += gain_v * innovation
        p_xx, p_xv, p_vv = (1 - gain_x) * p_xx, (1 - gain_x) * p_xv, p_vv - gain_v * p_xv
    place, radius_m = expected_at(track, 3.0)
    assert place == pytest.approx((states[0][0], states[1][0]), abs=0.01)
    assert radius_m == pytest.approx(4 * math.sqrt(p_xx) + 12, abs=0.01)
    ahead, _ = expected_at(track, 5.0)
    assert ahead == pytest.approx((states[0][0] + 2 * states[0][1], states[1][0] + 2 * states[1][1]), abs=0.01)


def test_nothing_is_expected_before_the_first_fix() -> None:
    track = Track()
    assert track.expected(START) == NOTHING
    for seconds in (None, 0.0, 1.0):
        fix = lost(seconds)
        assert track.update(fix) is fix
    assert track.expected(START) == NOTHING
    assert track.update(fix_at(0, 0, 2)).status == "fix"
    assert track.expected(START + timedelta(seconds=2)).radius_m == pytest.approx(4 * math.sqrt(10) + 12)


def test_a_gap_is_bridged_with_growing_sigma_until_it_is_no_place_any_more() -> None:
    track = Track()
    flown(track, 20)
    coasted = [track.update(lost(20 + k)) for k in range(40)]
    told = [fix for fix in coasted if fix.status == "coasted"]
    assert 5 < len(told) < 30
    sigmas = [fix.sigma_m or 0.0 for fix in told]
    assert sigmas == sorted(sigmas)
    assert sigmas[0] < 5
    assert 30 < sigmas[-1] <= 50
    for k, fix in enumerate(told):
        assert fix.place is not None
        assert metres_from(ORIGIN, fix.place) == pytest.approx((200 + 10 * k, 0), abs=1 + k)
        assert (fix.reasons, fix.matches, fix.heading_deg, fix.map) == (("too dark",), 3, None, None)
    for k, fix in enumerate(coasted[len(told) :]):
        assert fix == lost(20 + len(told) + k)
    # A fix after all that is believed.
    found = fix_at(600, 30, 60)
    assert track.update(found) is found


def test_one_fix_alone_says_nothing_of_the_speed() -> None:
    """20 m/s in any direction: after three seconds the place is 60 m unsure."""
    track = Track()
    track.update(fix_at(0, 0, 0))
    assert [track.update(lost(k)).status for k in (1, 2, 3)] == ["coasted", "coasted", "no_fix"]


def test_one_outlier_is_rejected() -> None:
    track = Track()
    flown(track, 10)
    rejected = track.update(fix_at(500, 400, 10))
    assert rejected.status == "coasted"
    assert rejected.reasons == ("jumps 566 m from the expected place",)
    assert rejected.place is not None
    assert metres_from(ORIGIN, rejected.place) == pytest.approx((100, 0), abs=2)
    assert (rejected.tile, rejected.H_query_map, rejected.heading_deg, rejected.footprint) == (None, None, None, ())
    assert (rejected.inliers, rejected.matches) == (30, 50)
    assert [fix.status for fix in flown(track, 5, first=11)] == ["fix"] * 5


def test_outliers_that_do_not_agree_never_restart_the_track() -> None:
    track = Track(Motion(coast_m=1e6))
    flown(track, 10)
    spots = [(3000, 0), (0, 4000), (-3000, 0), (0, -5000), (4000, 4000), (-2000, 3000)]
    assert [track.update(fix_at(*spot, 10 + k)).status for k, spot in enumerate(spots)] == ["coasted"] * 6
    assert track.update(fix_at(160, 0, 16)).status == "fix"


@pytest.mark.parametrize("every", [1, 5])
def test_three_fixes_that_agree_restart_the_track(every: int) -> None:
    """The vehicle was elsewhere all the time: flying at 10 m/s there, with a picture each or every fifth second."""
    track = Track(Motion(coast_m=1e6))
    flown(track, 10)
    there = [fix_at(3000 + 10 * every * k, 2000, 9 + every * (k + 1)) for k in range(5)]
    answers = [track.update(fix) for fix in there]
    assert [fix.status for fix in answers] == ["coasted", "coasted", "fix", "fix", "fix"]
    assert answers[2:] == there[2:]
    assert expected_at(track, 9 + every * 6)[0] == pytest.approx((3000 + 50 * every, 2000), abs=3 + 4 * every)


def test_right_fixes_between_them_keep_outliers_from_agreeing() -> None:
    track = Track()
    flown(track, 10)
    statuses = []
    for k in range(10, 22, 2):
        statuses += [track.update(fix_at(3000, 0, k)).status, track.update(fix_at(10 * (k + 1), 0, k + 1)).status]
    assert statuses == ["coasted", "fix"] * 6


def test_over_the_antimeridian() -> None:
    origin = (52.0, 179.999)
    track = Track()
    for k in range(20):
        fix = fix_at(10 * k, 0, k, origin=origin)
        assert track.update(fix) is fix
    assert (fix.longitude or 0) < -179.99
    coasted = track.update(lost(20))
    assert coasted.place is not None
    assert metres_from(origin, coasted.place) == pytest.approx((200, 0), abs=2)
    assert -180 <= coasted.place[1] < -179.99


@pytest.mark.parametrize("setting", ["speed_m_s", "acceleration_m_s2", "interval_s", "floor_m", "coast_m", "restart"])
@pytest.mark.parametrize("value", [0, -1, math.nan])
def test_settings_out_of_range_are_named(setting: str, value: float) -> None:
    with pytest.raises(UserError, match=rf"motion\.{setting} must be above 0, got {value}"):
        Motion(**{setting: value})  # type: ignore[arg-type]
