import json
from pathlib import Path

from navigation_stubs import TRUTH, answer, photo_query, stub_map

from diffnav.evaluation.navigation.shown import shown_records, write_exports


def asked(names: str, *labels: tuple[str, str, str, str]) -> list:
    return [answer(name, labels=own) for name in names for own in labels]


def test_the_last_method_in_its_first_search():
    rows = [
        (method, matcher, mode, "day")
        for method in ("input", "net")
        for matcher, mode in (("sift", "shortlist"), ("orb", "shortlist"), ("sift", "exhaustive"))
    ]
    shown = shown_records(asked("ab", *rows))
    assert [(record.name, record.method, record.matcher, record.mode) for record in shown] == [
        ("a", "net", "sift", "shortlist"),
        ("b", "net", "sift", "shortlist"),
    ]


def test_asked_by_day_and_in_the_dark_it_is_the_dark():
    shown = shown_records(asked("ab", *(("net", "sift", "shortlist", light) for light in ("dark", "day"))))
    assert [(record.name, record.condition) for record in shown] == [("a", "dark"), ("b", "dark")]


def test_delivered_in_either_light_they_are_all_shown():
    records = [answer("a", labels=("net", "sift", "shortlist", "day"))]
    records.append(answer("b", labels=("net", "sift", "shortlist", "dark")))
    assert shown_records(records) == records


def test_the_files_hold_the_shown_answers(tmp_path: Path):
    records = [*asked("a", ("input", "sift", "shortlist", "day"), ("net", "sift", "shortlist", "day"))]
    records += [answer("b", "no_fix", labels=("net", "sift", "shortlist", "day"), reasons=("too dark",))]
    queries = [photo_query(tmp_path, name) for name in "ab"]
    paths = write_exports(tmp_path / "out", records, queries, [stub_map()])
    assert [path.name for path in paths] == ["map.html", "fixes.geojson", "fixes.gpx", "fixes.nmea"]
    features = json.loads(paths[1].read_text())["features"]
    points = [one["geometry"]["coordinates"] for one in features if (one["geometry"] or {}).get("type") == "Point"]
    assert [TRUTH[1], TRUTH[0]] in [point[:2] for point in points]
    assert "too dark" in paths[0].read_text()
    # GGA, of which the seventh field is the quality: 1 and, without a fix, 0.
    qualities = [line.split(",")[6] for line in paths[3].read_text().splitlines() if "GGA" in line]
    assert qualities == ["1", "0"]


def test_no_fix_at_all(tmp_path: Path):
    paths = write_exports(tmp_path, [answer("a", "no_fix")], [photo_query(tmp_path, "a")], [stub_map()])
    assert all(path.stat().st_size > 0 for path in paths[:3])
