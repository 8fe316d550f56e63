from dataclasses import replace

from navigation_stubs import answer

from diffnav.evaluation.navigation.headings import heading_recall, heading_table


def seen(heading_deg: float | None, error_m: float = 0.0, status: str = "fix", **facts):
    return replace(answer(f"{heading_deg} {error_m}", status, error_m, **facts), query_heading_deg=heading_deg)


def test_each_query_counts_for_the_nearest_of_24_headings() -> None:
    records = [seen(0.0), seen(352.6, 9.0), seen(352.4, 9.0), seen(7.4, 11.0), seen(7.6), seen(90.0, status="no_fix")]
    assert heading_recall(records) == {0: (2, 3), 15: (1, 1), 90: (0, 1), 345: (1, 1)}


def test_what_has_no_truth_or_heading_does_not_count() -> None:
    records = [seen(None), seen(30.0, on_map=False), replace(seen(30.0), has_truth=False)]
    assert heading_recall(records) == {}


def test_a_table_stands_only_where_headings_differ() -> None:
    north = [seen(0.0), seen(3.0), seen(358.0)]
    assert heading_table(north) == ""
    dark = ("net", "sift", "shortlist", "dark")
    around = [seen(heading) for heading in (0.0, 90.0, 180.0, 270.0)] + [seen(90.0, 20.0), seen(90.0, labels=dark)]
    lines = heading_table(around).splitlines()
    assert [cell.strip() for cell in lines[0].split("|")[1:-1]] == [
        "heading, degrees", "queries", "net, sift, shortlist, day", "net, sift, shortlist, dark",
    ]  # fmt: skip
    assert [cell.strip() for cell in lines[3].split("|")[1:-1]] == ["90", "2", "0.50", "1.00"]
    assert [cell.strip() for cell in lines[2].split("|")[1:-1]] == ["0", "1", "1.00", "-"]
