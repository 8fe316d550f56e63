"""The page of the driving experiment: its table, the paper's figures, confusion, failures; and per_query.csv."""

from dataclasses import replace

import pytest
from driving_stubs import answer, hand_drive

from diffnav.evaluation.driving.page import confusion_table, driving_page, driving_table, failure_sentences
from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.driving.rows import driving_rows
from diffnav.evaluation.driving.tables import query_lines


def cells(table: str) -> list[dict[str, str]]:
    """The lines of a Markdown table, column -> cell."""
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    return [dict(zip(lines[0], line, strict=True)) for line in lines[2:]]


def records(matcher: str = "orb_gms") -> list[DrivingRecord]:
    """`input`: right, 1 after, none, 3 before, on another road; `net`: right at 0 to 2; `normal`: always right."""
    winners = {"input": [0, 2, None, 0, 0], "net": [0, 1, 2, 4, 0], "normal": [0, 1, 2, 3, 4]}
    seconds = {"seconds_enhance": 0.0001, "seconds_features": 0.0002, "seconds_match": 0.0003}
    return [
        answer(k, winner, method, 12, matcher, **seconds)
        for method, own in winners.items()
        for k, winner in enumerate(own)
    ]


def test_the_table() -> None:
    low, net, normal = cells(driving_table(driving_rows(records(), hand_drive())))
    assert list(low) == [
        "method", "matcher", "ranked by", "Acc", "+-1", "2 m", "5 m", "10 m", "MP", "with partner", "gap closed", "s",
        "n",
    ]  # fmt: skip
    assert (low["method"], low["matcher"], low["ranked by"], low["n"]) == ("input", "orb_gms", "matches", "5")
    assert (low["Acc"].split()[0], low["+-1"], low["5 m"], low["10 m"]) == ("0.200", "0.400", "0.400", "0.600")
    assert (low["MP"], low["with partner"], low["s"]) == ("9.6", "3.0", "< .001")
    assert (low["gap closed"], normal["gap closed"]) == ("-", "-")
    assert net["gap closed"].startswith("0.50 [")


def test_columns_that_nothing_is_known_of_are_left_out() -> None:
    drive = hand_drive(consecutive=False)
    rows = driving_rows(records(), drive)
    assert "+-1" not in driving_table(rows)
    unknown = [{**row, "accuracy_2m": None, "accuracy_5m": None, "accuracy_10m": None} for row in rows]
    assert " m " not in driving_table(unknown).splitlines()[0]


def test_confusion_among_moments_by_hand() -> None:
    drive = hand_drive()
    far = [answer(3, 4, "far"), answer(1, 0, "far"), answer(0, 3, "far")]
    counted = {line["method"]: line for line in cells(confusion_table(records() + far, drive))}
    columns = ["< -3", "-3", "-2", "-1", "0", "+1", "+2", "+3", "> +3", "other record", "none"]
    assert list(counted["input"]) == ["method", "matcher", *columns]
    assert [counted["input"][column] for column in columns] == list("01001100011")
    assert [counted["net"][column] for column in columns] == list("00003000020")
    assert [counted["normal"][column] for column in columns] == list("00005000000")
    assert [counted["far"][column] for column in columns] == list("00010001010")


def test_answers_far_off_are_counted_together() -> None:
    drive = hand_drive()
    drive.references[3] = replace(drive.references[3], index=9)
    (line,) = cells(confusion_table([answer(0, 3), answer(3, 0)], drive))
    assert (line["< -3"], line["> +3"], line["0"]) == ("1", "1", "0")


def test_the_whole_page() -> None:
    drive = hand_drive(unmatched=["left/7: no reference; left out"])
    some = [*records(), answer(0, method="weak", failure="orb_gms: no memory")]
    rows = driving_rows(some, drive)
    page = driving_page(rows, some, drive, {"seed": 3})
    assert page.startswith("# Driving")
    assert driving_table(rows) in page
    assert "low-light + GMS Acc 0.388, MP 47.52; enhanced + GMS Acc 0.727, MP 94.10" in page
    assert "normal-light + GMS Acc 0.801, MP 118.71; gap closed .82" in page
    assert confusion_table(some, drive) in page
    assert "## Failed\n\n- weak on all 1: orb_gms: no memory\n" in page
    assert "## Left out\n\n- left/7: no reference; left out\n" in page
    assert "- seed: `3`" in page
    assert page.endswith("\n")


def test_what_there_is_nothing_to_say_of() -> None:
    scenes = hand_drive(consecutive=False)
    page = driving_page(driving_rows(records("sift"), scenes), records("sift"), scenes, {})
    for absent in ("Table 3", "moments off", "## Failed", "## Left out"):
        assert absent not in page


def test_failures_are_told_once() -> None:
    some = [
        answer(0, 0, "net", inliers=[[0, 9]]),
        answer(1, method="net", failure="net: out of memory"),
        answer(0, 0, "net", matcher="sift"),
        answer(1, method="net", matcher="sift", failure="net: out of memory"),
        answer(0, method="blind", failure="left/a0.png: damaged"),
        answer(1, method="blind", failure="left/a0.png: damaged"),
    ]
    rows = driving_rows(some, hand_drive())
    # Two matchers and, for both rankings, two rows each.
    assert len(rows) == 6
    assert failure_sentences(rows) == [
        "net on left/a1: net: out of memory",
        "blind on all 2: left/a0.png: damaged",
    ]


def test_a_line_per_answer() -> None:
    drive = hand_drive()
    asked = [
        answer(1, 3, "net", 12, inliers=[[3, 2], [2, 8]], gamma=3.5, seconds_enhance=0.25),
        answer(4, None, "net"),
        answer(0, method="net", failure="orb_gms: no memory"),
    ]
    line, nothing, failed = query_lines(asked, drive)
    assert {key: line[key] for key in ("method", "matcher", "record", "query", "partner")} == {
        "method": "net", "matcher": "orb_gms", "record": "a", "query": "left/a1", "partner": "right/a1",
    }  # fmt: skip
    assert (line["answer_by_matches"], line["moments_off_by_matches"]) == ("right/a3", 2)
    assert line["metres_off_by_matches"] == pytest.approx(6.5)
    assert (line["answer_by_inliers"], line["moments_off_by_inliers"]) == ("right/a2", 1)
    assert (line["matches"], line["matches_with_partner"]) == (12, 1)
    assert (line["gamma"], line["seconds_enhance"], line["seconds_match"], line["failure"]) == (3.5, 0.25, None, None)
    assert (nothing["answer_by_matches"], nothing["matches"], nothing["moments_off_by_matches"]) == (None, 0, None)
    assert (failed["matches_with_partner"], failed["failure"]) == (None, "orb_gms: no memory")
