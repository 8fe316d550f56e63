import json
from dataclasses import asdict, replace
from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest
import torch

from diffnav.data.queries.query import Query
from diffnav.evaluation.navigation.records import NavigationRecord, record_of
from diffnav.evaluation.records import RecordLog
from diffnav.navigation.fix import Fix

LABELS = ("net", "sift", "shortlist", "dark")
FIX = Fix(
    query="a/1",
    status="fix",
    latitude=47.001,
    longitude=8.0,
    heading_deg=350.0,
    ground_sample_distance_m=0.3,
    sigma_m=0.5,
    footprint=((47.0, 7.9), (47.0, 8.1), (46.9, 8.1), (46.9, 7.9)),
    H_query_map=torch.tensor([[0.1, 0.2, 30.0], [-0.2, 0.1, 1 / 3], [1e-5, 0.0, 1.0]], dtype=torch.float64),
    map="north",
    tile="north/0,600",
    inliers=40,
    matches=60,
    enhanced=True,
    definition=3.25,
    milliseconds={"read": 5000.0, "gate": 10.0, "enhance": 300.0, "match": 90.0},
    time=datetime(2021, 5, 1, 22, 30, 0, 250_000, tzinfo=timezone(timedelta(hours=2))),
)
QUERY = Query("a/1", Path("a/1.jpg"), (47.0, 8.0), heading_deg=10.0, ground_sample_distance_m=0.25)


def test_a_fix_comes_back_from_the_file_as_it_was(tmp_path: Path):
    log = RecordLog(tmp_path / "records.jsonl", NavigationRecord)
    log.add(record_of(FIX, QUERY, "key", LABELS))
    (found,) = (RecordLog(tmp_path / "records.jsonl", NavigationRecord).find("key"),)
    fix = found.fix
    assert torch.equal(fix.H_query_map, FIX.H_query_map)
    assert fix.H_query_map.dtype == torch.float64
    assert replace(fix, H_query_map=None) == replace(FIX, H_query_map=None)
    assert fix.time.utcoffset() == timedelta(hours=2)
    assert (found.method, found.matcher, found.mode, found.condition, found.name) == (*LABELS, "a/1")


def test_no_fix_comes_back_too():
    fix = Fix("a/1", "no_fix", reasons=("12 inliers, fewer than 15", "too far"))
    record = record_of(fix, replace(QUERY, truth=None), "key", LABELS)
    again = NavigationRecord(**json.loads(json.dumps(asdict(record))))
    assert again.fix == fix
    assert (again.is_fix, again.is_usable, again.has_truth) == (False, False, False)
    assert (again.error_m, again.heading_error_deg, again.scale_ratio, again.seconds) == (None, None, None, 0)


def test_figures_against_the_truth():
    record = record_of(FIX, QUERY, "key", LABELS)
    # A thousandth of a degree of latitude on a sphere of 6,371,008.8 m.
    assert record.error_m == pytest.approx(111.19508, abs=1e-4)
    assert record.scale_ratio == pytest.approx(1.2)
    # Reading is left out.
    assert record.seconds == pytest.approx(0.4)
    assert (record.on_map, record.has_truth, record.failure) == (True, True, None)


@pytest.mark.parametrize(
    ("found_deg", "known_deg", "error_deg"),
    [(350, 10, -20), (10, 350, 20), (359.5, 0.25, -0.75), (90, 90, 0), (270, 80, -170), (80, 270, 170), (180, 0, 180)],
)
def test_headings_differ_the_short_way_round(found_deg: float, known_deg: float, error_deg: float):
    record = record_of(replace(FIX, heading_deg=found_deg), replace(QUERY, heading_deg=known_deg), "key", LABELS)
    assert abs(record.heading_error_deg) == pytest.approx(abs(error_deg))
    assert error_deg == 180 or record.heading_error_deg == pytest.approx(error_deg)


def test_a_coasted_place_has_an_error_and_is_no_fix():
    record = record_of(replace(FIX, status="coasted", heading_deg=None), QUERY, "key", LABELS)
    assert not record.is_fix
    assert record.error_m == pytest.approx(111.19508, abs=1e-4)
    assert record.heading_error_deg is None


def test_as_a_line_of_a_table():
    line = record_of(replace(FIX, reasons=("one", "two")), QUERY, "key", LABELS).flat()
    assert (line["name"], line["status"], line["reasons"], line["ms_match"]) == ("a/1", "fix", "one; two", 90)
    assert (line["latitude"], line["tile"], line["enhanced"]) == (47.001, "north/0,600", True)
    failed = record_of(Fix("a/1", "no_fix"), QUERY, "key", LABELS, "sift: out of memory")
    assert failed.flat()["reasons"] == "sift: out of memory"
