import re

from navigation_stubs import answer

from diffnav.evaluation.navigation.page import navigation_page, navigation_table
from diffnav.evaluation.navigation.rows import navigation_rows

RECORDS = [
    answer("a", error_m=2.345),
    answer("b", error_m=120),
    answer("c", "no_fix", reasons=("12 inliers, fewer than 15",)),
    answer("d", "no_fix", reasons=("9 inliers, fewer than 15",)),
    answer("e", "no_fix", reasons=("stretched 3.1 times, more than 2.0", "uncertain by 22.0 m, more than 15.0 m")),
    answer("f", "no_fix", on_map=False, reasons=("no tile's matches agree on a homography",)),
]


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_the_table():
    header, _, line = navigation_table(navigation_rows(RECORDS)).splitlines()
    row = dict(zip(cells(header), cells(line), strict=True))
    assert (row["method"], row["matcher"], row["mode"], row["light"]) == ("net", "sift", "shortlist", "day")
    assert (row["queries"], row["fixes"], row["false"], row["off map"]) == ("5", "2", "1", "0 of 1")
    # One of five within 5 m; the mean of 2.345 and 120; the larger of both; Wilson's bound of 1 of 6.
    assert (row["@5 m"], row["@50 m"], row["median, m"], row["p90, m"]) == ("0.200", "0.200", "61.17", "120.00")
    assert row["wrong"] == "56.35%"


def test_what_does_not_exist_is_a_dash():
    line = cells(navigation_table(navigation_rows([answer("a", "no_fix", truth=None)])).splitlines()[-1])
    assert line[6:] == ["-"] * 6 + ["0", "-", "-", "< .001"]
    assert len(navigation_table([]).splitlines()) == 2


def test_reasons_are_counted_without_their_numbers_for_pictures_on_the_map():
    page = navigation_page(navigation_rows(RECORDS), RECORDS, {"seed": 3, "maps": {"count": 2}})
    (line,) = re.findall(r"^- net, sift, shortlist, day: (.*)$", page, re.M)
    assert (
        line == "2 x N inliers, fewer than N; 1 x stretched N times, more than N; 1 x uncertain by N m, more than N m"
    )
    assert "homography" not in page
    assert "- seed: `3`" in page
    assert '- maps: `{"count": 2}`' in page


def test_no_section_of_reasons_where_everything_was_located():
    assert "Why there was no fix" not in navigation_page(navigation_rows(RECORDS[:2]), RECORDS[:2], {})
