import math
from statistics import NormalDist

import pytest
from navigation_stubs import answer

from diffnav.evaluation.navigation.rows import navigation_rows, wilson_upper


def slow_wilson_upper(count: int, of: int) -> float:
    """The larger p at which the observed share lies 1.96 standard errors of p below it, by bisection."""
    z, share = NormalDist().inv_cdf(0.975), count / of
    low, high = share, 1.0
    for _ in range(200):
        p = (low + high) / 2
        inside = (p - share) <= z * math.sqrt(p * (1 - p) / of)
        low, high = (p, high) if inside else (low, p)
    return low


@pytest.mark.parametrize(("count", "of"), [(0, 4000), (3, 4000), (1, 7), (5, 10), (0, 1), (10, 10)])
def test_the_bound_solves_the_score_equation(count: int, of: int):
    assert wilson_upper(count, of) == pytest.approx(slow_wilson_upper(count, of), abs=1e-6)


def test_the_bounds_that_matter():
    assert f"{wilson_upper(0, 4000):.3%}" == "0.096%"
    assert f"{wilson_upper(3, 4000):.3%}" == "0.220%"
    assert wilson_upper(0, 0) is None


def test_a_row_by_hand():
    records = [
        *(answer(f"fix_{error_m}", error_m=error_m, heading_deg=1.0) for error_m in (1, 6, 20, 60)),
        answer("coasted", "coasted", 3),
        answer("silent", "no_fix"),
        answer("fix_without_truth", truth=None),
        answer("silent_without_truth", "no_fix", truth=None),
        answer("off_1", "no_fix", on_map=False),
        answer("off_2", "no_fix", on_map=False),
        answer("off_3", on_map=False),
    ]
    (row,) = navigation_rows(records)
    assert (row["queries"], row["fixes"], row["availability"]) == (8, 5, 0.625)
    # Of the six with truth; a coasted place is no answer of the picture itself.
    shares = [row[f"recall_{limit}m"] for limit in (5, 10, 25, 50)]
    assert shares == pytest.approx([1 / 6, 2 / 6, 3 / 6, 3 / 6], abs=1e-6)
    assert (row["median_m"], row["p90_m"]) == pytest.approx((13, 60), abs=1e-3)
    assert (row["false_fixes"], row["offmap_queries"], row["offmap_fixes"]) == (1, 3, 1)
    assert row["false_rate"] == pytest.approx(2 / 9, abs=1e-6)
    assert row["false_rate_upper"] == pytest.approx(slow_wilson_upper(2, 9), abs=1e-6)
    assert row["offmap_rate_upper"] == pytest.approx(slow_wilson_upper(1, 3), abs=1e-6)
    assert row["false_of_fixes_upper"] == pytest.approx(slow_wilson_upper(1, 4), abs=1e-6)
    assert row["sigma_median_m"] == 1


def test_the_ninetieth_percentile_is_an_error_that_was_made():
    (row,) = navigation_rows([answer(str(k), error_m=k) for k in range(1, 11)])
    assert row["p90_m"] == pytest.approx(9, abs=1e-3)
    assert row["median_m"] == pytest.approx(5.5, abs=1e-3)


def test_an_error_of_fifty_metres_is_not_yet_a_false_fix():
    (row,) = navigation_rows([answer("near", error_m=49.99), answer("far", error_m=50.01)])
    assert (row["false_fixes"], row["recall_50m"]) == (1, 0.5)


def test_queries_without_truth_have_nulls():
    (row,) = navigation_rows([answer("a", truth=None), answer("b", "no_fix", truth=None)])
    assert (row["queries"], row["fixes"], row["availability"], row["false_fixes"]) == (2, 1, 0.5, 0)
    unknown = ("recall_5m", "recall_50m", "median_m", "p90_m", "false_rate", "false_rate_upper", "offmap_rate_upper")
    assert [row[key] for key in unknown] == [None] * len(unknown)


def test_queries_off_the_map_alone():
    (row,) = navigation_rows([answer(str(k), "no_fix", on_map=False) for k in range(40)])
    assert (row["queries"], row["fixes"], row["availability"], row["recall_10m"]) == (0, 0, None, None)
    assert (row["offmap_queries"], row["offmap_fixes"], row["false_rate"]) == (40, 0, 0)
    assert row["false_rate_upper"] == row["offmap_rate_upper"] == pytest.approx(slow_wilson_upper(0, 40), abs=1e-6)


def test_pictures_that_could_not_be_used_took_no_time():
    times = {"ms": {"read": 9000.0, "match": 250.0, "gate": 50.0}}
    records = [
        answer("a", milliseconds=times["ms"]),
        answer("b", milliseconds=times["ms"]),
        *(answer(f"lost_{k}", "no_fix", definition=None) for k in range(5)),
    ]
    (row,) = navigation_rows(records)
    assert row["seconds"] == pytest.approx(0.3)
    assert row["availability"] == pytest.approx(2 / 7, abs=1e-6)
    (row,) = navigation_rows(records[2:])
    assert row["seconds"] is None


def test_rows_by_method_matcher_mode_and_condition_in_the_order_of_their_first_records():
    labels = [
        ("net", "sift", "shortlist", "dark"),
        ("input", "sift", "shortlist", "dark"),
        ("net", "orb", "shortlist", "dark"),
        ("net", "sift", "exhaustive", "dark"),
        ("net", "sift", "shortlist", "day"),
    ]
    rows = navigation_rows([answer(name, labels=own) for name in ("a", "b") for own in labels])
    assert [(row["method"], row["matcher"], row["mode"], row["condition"]) for row in rows] == labels
    assert [row["queries"] for row in rows] == [2] * 5
