"""The figures of the driving table, from records and a drive that were made by hand."""

import math
from dataclasses import replace

import pytest
from driving_stubs import answer, hand_drive, row_of

from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.driving.rows import driving_rows, offsets


def input_records(method: str = "input", **facts) -> list[DrivingRecord]:
    """Right; 1 moment and 1.5 m off; nothing; 3 moments and 8 m off; on another road."""
    return [answer(k, winner, method, 10 + k, **facts) for k, winner in enumerate((0, 2, None, 0, 0))]


def right(method: str, *numbers: int, count: int = 20) -> list[DrivingRecord]:
    """Right at these queries, on the other road or the first frame elsewhere."""
    return [answer(k, k if k in numbers else 0 if k == 4 else 4, method, count) for k in range(5)]


def test_accuracy_neighbours_and_metres_by_hand() -> None:
    (row,) = driving_rows(input_records(), hand_drive())
    assert (row["method"], row["matcher"], row["ranking"]) == ("input", "orb_gms", "matches")
    assert (row["queries"], row["references"]) == (5, 5)
    assert row["accuracy"] == 0.2
    assert row["accuracy_pm1"] == 0.4
    # The answer at 8 m, the one on another road and the missing one are farther off than 5 m.
    assert (row["accuracy_2m"], row["accuracy_5m"], row["accuracy_10m"]) == (0.4, 0.4, 0.6)
    # 10, 11, none, 13 and 14 matches with the answers; with the partners 10, 1, 0, 1 and 1.
    assert row["mp"] == pytest.approx(48 / 5)
    assert row["mp_partner"] == pytest.approx(13 / 5)
    assert row["failures"] == []


def test_offsets_are_signed_moments() -> None:
    *near, far = offsets(input_records(), hand_drive(), "matches")
    assert near == [0, 1, None, -3]
    assert math.isinf(far)


def test_what_a_drive_does_not_know_is_none() -> None:
    drive = hand_drive(consecutive=False)
    unknown = [replace(frame, position_m=None) for frame in drive.references]
    (row,) = driving_rows(input_records(), replace(drive, references=unknown))
    assert row["accuracy"] == 0.2
    figures = ("accuracy_pm1", "accuracy_2m", "accuracy_5m", "accuracy_10m", "gap_closed", "gap_closed_ci", "seconds")
    assert [row[name] for name in figures] == [None] * 7
    # Known of the first two partners alone: one right, one 1.5 m off.
    (row,) = driving_rows(input_records(), replace(drive, references=drive.references[:3] + unknown[3:]))
    assert row["accuracy_2m"] == pytest.approx(2 / 3, abs=1e-6)


def test_failures_count_as_wrong_and_are_named() -> None:
    records = right("net", 0, 1, 2, 3, 4)
    records[2] = answer(2, method="net", failure="orb_gms: no memory")
    (row,) = driving_rows(records, hand_drive())
    assert (row["queries"], row["accuracy"], row["mp"]) == (5, 0.8, 16)
    assert (row["accuracy_pm1"], row["accuracy_10m"]) == (0.8, 0.8)
    assert row["failures"] == [{"name": "left/a2", "why": "orb_gms: no memory"}]


def test_what_a_shortlist_left_out_is_no_match() -> None:
    """-1 stands for a reference that was not matched: it is no answer, and no number of matches."""
    records = [
        answer(0, counts=[-1, 4, -1, -1, 2]),
        answer(1, counts=[-1, -1, -1, -1, -1]),
        answer(2, counts=[-1, 0, 6, 0, 0]),
    ]
    (row,) = driving_rows(records, hand_drive())
    assert row["accuracy"] == pytest.approx(1 / 3, abs=1e-6)
    assert row["mp"] == pytest.approx(10 / 3, abs=1e-6)
    assert row["mp_partner"] == 2


def test_seconds_are_the_median_from_the_dark_picture_to_the_answer() -> None:
    stages = [(1.0, 0.1, 0.01), (2.0, 0.2, 0.02), (9.0, 0.3, 0.03), (None, 0.5, 0.5)]
    records = [
        answer(k, k, seconds_enhance=a, seconds_features=b, seconds_match=c, seconds_verify=50.0)
        for k, (a, b, c) in enumerate(stages)
    ]
    (row,) = driving_rows(records, hand_drive())
    assert row["seconds"] == pytest.approx(2.22)


def test_the_gap_closed_by_hand() -> None:
    records = right("input", 0) + right("net", 0, 1, 2) + right("bad") + right("normal", 0, 1, 2, 3, 4)
    rows = driving_rows(records, hand_drive())
    assert [row["method"] for row in rows] == ["input", "net", "bad", "normal"]
    # (3 - 1) / (5 - 1); worse than the dark picture is less than nothing.
    assert row_of(rows, "net")["gap_closed"] == 0.5
    assert row_of(rows, "bad")["gap_closed"] == -0.25
    for end in ("input", "normal"):
        assert (row_of(rows, end)["gap_closed"], row_of(rows, end)["gap_closed_ci"]) == (None, None)
    for name in ("net", "bad"):
        low, high = row_of(rows, name)["gap_closed_ci"]
        assert low < row_of(rows, name)["gap_closed"] < high


def test_without_a_gap_nothing_can_be_closed() -> None:
    level = right("input", 0, 1) + right("net", 0, 1, 2) + right("normal", 3, 4)
    no_end = right("net", 0, 1, 2) + right("normal", 0)
    other_matcher = [replace(record, matcher="sift") for record in right("input", 0)]
    for records in (level, no_end, no_end + other_matcher):
        row = row_of(driving_rows(records, hand_drive()), "net")
        assert (row["gap_closed"], row["gap_closed_ci"]) == (None, None)


def test_the_gap_is_of_the_queries_that_all_three_have() -> None:
    """Of the first three queries the dark picture has 1 right, the network 2, daylight 3."""
    records = right("input", 0)[:3] + right("net", 0, 1, 3, 4) + right("normal", 0, 1, 2, 3, 4)[:3]
    assert row_of(driving_rows(records, hand_drive()), "net")["gap_closed"] == 0.5


def many(method: str, hits: list[int]) -> list[DrivingRecord]:
    return [
        replace(answer(0, 0 if hit else 1, method), name=f"left/{k}", key=f"{method} {k}") for k, hit in enumerate(hits)
    ]


def test_accuracys_interval_holds_it_and_is_as_wide_as_it_should_be() -> None:
    hits = [1] * 30 + [0] * 70
    (row,) = driving_rows(many("net", hits), hand_drive(), seed=3)
    low, high = row["accuracy_ci"]
    assert low < row["accuracy"] == 0.3 < high
    # 1.96 standard errors of a share to either side.
    assert high - low == pytest.approx(2 * 1.96 * (0.3 * 0.7 / 100) ** 0.5, rel=0.1)
    assert driving_rows(many("net", hits), hand_drive(), seed=3)[0] == row


def test_the_gaps_interval_draws_queries_for_all_three_together() -> None:
    """Who is right exactly where daylight is closes the gap in every draw, whoever is wrong where it is."""
    low, high = [1, 0, 0, 0] * 5, [1, 1, 0, 1] * 5
    records = many("input", low) + many("as daylight", high)[::-1] + many("as dark", low) + many("normal", high)
    rows = driving_rows(records, hand_drive())
    assert (row_of(rows, "as daylight")["gap_closed"], row_of(rows, "as daylight")["gap_closed_ci"]) == (1, [1, 1])
    assert (row_of(rows, "as dark")["gap_closed"], row_of(rows, "as dark")["gap_closed_ci"]) == (0, [0, 0])


def test_the_gaps_interval_by_hand() -> None:
    """Two queries, one of them won: a draw closes none, half or all of the gap, with 1/4, 1/2 and 1/4."""
    records = many("input", [0, 0]) + many("net", [1, 0]) + many("normal", [1, 1])
    row = row_of(driving_rows(records, hand_drive()), "net")
    assert (row["gap_closed"], row["gap_closed_ci"]) == (0.5, [0, 1])
    # Draws without a gap tell nothing: what is left closes it.
    records = many("input", [0, 1]) + many("net", [1, 1]) + many("normal", [1, 1])
    assert row_of(driving_rows(records, hand_drive()), "net")["gap_closed_ci"] == [1, 1]


def test_both_rankings_where_matches_were_verified() -> None:
    """By matches the second is wrong, by inliers the first."""
    records = [
        answer(0, 0, "net", inliers=[[0, 3], [1, 8]]),
        answer(1, 3, "net", inliers=[[3, 2], [1, 9]]),
        answer(0, 0, "other", inliers=[]),
    ]
    rows = driving_rows(records, hand_drive())
    assert [(row["method"], row["ranking"]) for row in rows] == [
        ("net", "matches"), ("other", "matches"), ("net", "inliers"), ("other", "inliers"),
    ]  # fmt: skip
    assert [row["accuracy"] for row in rows] == [0.5, 1, 0.5, 0]
    # The matches with the answer by inliers: 1 each.
    assert [row["mp"] for row in rows] == [10, 10, 1, 0]
    assert offsets(records, hand_drive(), "inliers") == [1, 0, None]


def test_a_third_ranking_where_rows_are_kept() -> None:
    records = [answer(0, 0, "net", rows=[[0, 3], [1, 8]]), answer(1, 3, "net", rows=[[3, 2], [1, 9]])]
    rows = driving_rows(records, hand_drive())
    assert [(row["ranking"], row["accuracy"]) for row in rows] == [("matches", 0.5), ("rows", 0.5)]
    assert [record.answer("rows") for record in records] == [1, 1]


def test_matchers_have_rows_of_their_own() -> None:
    records = right("net", 0) + [replace(record, matcher="sift") for record in right("net", 0, 1)]
    rows = driving_rows(records, hand_drive())
    assert [(row["matcher"], row["accuracy"]) for row in rows] == [("orb_gms", 0.2), ("sift", 0.4)]
