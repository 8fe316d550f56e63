"""Pairs by name and by time against a slow search, and what is said of frames without a partner."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diffnav.data.driving.driving_set import Frame
from diffnav.data.driving.pairing import natural, pair_frames
from diffnav.errors import UserError


def frames(camera: str, moments: dict[str, float | None], record: str = "drive") -> list[Frame]:
    return [
        Frame(f"{camera}/{moment}", Path(f"{camera}/{moment}.jpg"), camera, record, moment, time_s)
        for moment, time_s in moments.items()
    ]


def timed(camera: str, times: list[float]) -> list[Frame]:
    return frames(camera, {f"{k}@{time}": time for k, time in enumerate(times)})


def names(drive) -> list[tuple[str, str]]:
    return [(q.name, drive.references[k].name) for q, k in zip(drive.queries, drive.truth, strict=True)]


def test_dropped_frames_are_listed_and_never_zipped() -> None:
    """One missing on each side: equal counts, so that zipping sorted lists would go unnoticed."""
    left, right = frames("left", dict.fromkeys("acd")), frames("right", dict.fromkeys("abd"))
    drive = pair_frames("x", left, right, consecutive=True)
    assert names(drive) == [("left/a", "right/a"), ("left/d", "right/d")]
    assert [q.index for q in drive.queries] == [r.index for r in drive.references] == [0, 3]
    assert drive.unmatched == [
        "right/b: no query in record drive named b; left out",
        "left/c: no reference in record drive named c; left out",
    ]


def test_pairs_come_by_record_and_then_by_number() -> None:
    order = [("2", "10"), ("10", "9"), ("2", "9")]
    sides = [[Frame(f"{c}/{r}/{m}", Path("x"), c, r, m) for r, m in order] for c in ("left", "right")]
    drive = pair_frames("x", sides[0], sides[1][::-1], consecutive=True)
    assert [(q.record, q.moment) for q in drive.queries] == [("2", "9"), ("2", "10"), ("10", "9")]
    assert [q.index for q in drive.queries] == [0, 1, 0]
    assert drive.counts == {"2": 2, "10": 1}


def test_names_pair_within_a_record_alone() -> None:
    left, right = frames("left", {"1": None, "2": None}, "a"), frames("right", {"2": None}, "b")
    with pytest.raises(UserError, match=r"x: no picture has a partner \(queries: 2 pictures, e\.g\. left/1; "):
        pair_frames("x", left, right, consecutive=True)


def test_jittered_times_pair_within_the_tolerance() -> None:
    left, right = timed("left", [0.0, 0.1, 0.2, 0.3]), timed("right", [0.004, 0.098, 0.312])
    drive = pair_frames("x", left, right, True, tolerance_s=0.005)
    assert names(drive) == [("left/0@0.0", "right/0@0.004"), ("left/1@0.1", "right/1@0.098")]
    assert [sentence.split(":")[0] for sentence in drive.unmatched] == ["left/2@0.2", "left/3@0.3", "right/2@0.312"]
    assert "within 0.005 s" in drive.unmatched[0]
    assert len(pair_frames("x", left, right, True, tolerance_s=0.012)) == 3


def test_a_partner_is_shared_by_nobody() -> None:
    """Both queries are near the one reference; the nearer has it, although the other comes first."""
    drive = pair_frames("x", timed("left", [0.0, 0.010]), timed("right", [0.006]), True, tolerance_s=0.1)
    assert names(drive) == [("left/1@0.01", "right/0@0.006")]
    assert drive.queries[0].index == 1


def test_tolerance_holds_at_its_limit_for_seconds_since_1970() -> None:
    left, right = timed("left", [1602074967.05]), timed("right", [1602074967.06])
    assert len(pair_frames("x", left, right, True, tolerance_s=0.01)) == 1
    with pytest.raises(UserError, match="no picture has a partner"):
        pair_frames("x", left, right, True, tolerance_s=0.0099)


times = st.lists(st.integers(0, 60), unique=True, max_size=12).map(lambda ticks: [tick / 4 for tick in ticks])


@settings(max_examples=150, deadline=None)
@given(left=times, right=times, tolerance=st.sampled_from([0.0, 0.3, 1.0, 20.0]))
def test_pairs_by_time_are_the_mutually_nearest(left, right, tolerance) -> None:
    def nearest(time, others):
        return min(others, key=lambda other: (abs(other - time), other))

    expected = sorted(
        (a, b)
        for a in left
        for b in right
        if nearest(a, right) == b and nearest(b, left) == a and abs(a - b) <= tolerance
    )
    if not expected:
        with pytest.raises(UserError, match="no picture has a partner"):
            pair_frames("x", timed("left", left), timed("right", right), True, tolerance_s=tolerance)
        return
    drive = pair_frames("x", timed("left", left), timed("right", right), True, tolerance_s=tolerance)
    assert [(q.time_s, r.time_s) for q, r in zip(drive.queries, drive.references, strict=True)] == expected
    assert len(drive.unmatched) == len(left) + len(right) - 2 * len(expected)
    assert [q.index for q in drive.queries] == sorted({q.index for q in drive.queries})


def test_mistakes_are_one_sentence() -> None:
    left, right = frames("left", {"a": None}), frames("right", {"a": 1.0})
    twice = [*left, Frame("other/a", Path("other/a.png"), "left", "drive", "a")]
    with pytest.raises(UserError, match=r"left/a\.jpg and other/a\.png are one camera's of one moment"):
        pair_frames("x", twice, right, True)
    with pytest.raises(UserError, match=r"left/a\.jpg: its time is unknown; set data\.tolerance_s=null"):
        pair_frames("x", left, right, True, tolerance_s=0.1)
    for wrong in (-0.1, float("inf"), float("nan")):
        with pytest.raises(UserError, match=r"data\.tolerance_s must be 0 or more"):
            pair_frames("x", left, right, True, tolerance_s=wrong)
    with pytest.raises(UserError, match=r"queries: none; references: 1 pictures, e\.g\. right/a\)"):
        pair_frames("x", [], right, True)


def test_natural_order() -> None:
    assert sorted(["Record10", "Record9", "Record009b", "a"], key=natural) == ["Record9", "Record009b", "Record10", "a"]
