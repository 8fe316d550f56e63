import json
import math
from itertools import pairwise

import pytest
from example_fixes import NASTY, fix, flight, lost

from diffnav.navigation.exports.geojson import write_geojson

SHOWN = NASTY.replace("\x07", "\ufffd").replace("\udc80", "\ufffd")


@pytest.fixture
def features(tmp_path):
    """All features of the flight, by kind."""
    truths = {"1": (-17.91, 179.97), "3": (-17.9, 179.99), NASTY: (-17.91, 180.015)}
    write_geojson(tmp_path / "f.geojson", flight(), truths)
    collection = json.loads((tmp_path / "f.geojson").read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert collection["type"] == "FeatureCollection"
    kinds: dict[str, list] = {}
    for feature in collection["features"]:
        assert feature["type"] == "Feature"
        kinds.setdefault(feature["properties"]["kind"], []).append(feature)
    return kinds


def test_every_picture_is_a_feature_longitude_first(features):
    places = [feature["geometry"] and feature["geometry"]["coordinates"] for feature in features["fix"]]
    assert places == [
        [179.97, -17.9], [179.985, -17.905], None, [-179.985, -17.91], None, None, [-179.96, -17.92], [-179.95, -17.93],
    ]  # fmt: skip
    assert [feature["properties"]["query"] for feature in features["fix"]] == ["1", "2", "3", SHOWN, "5", "6", "7", "8"]


def test_what_is_known_of_a_fix_is_kept(features):
    first, second, third = (feature["properties"] for feature in features["fix"][:3])
    assert (first["inliers"], first["matches"], first["map"], first["tile"]) == (40, 90, "Fiji", "3")
    assert second["milliseconds"] == {"match": 12.5}
    assert first["time"] == second["time"] == "2024-05-06T23:59:59.450000+00:00"
    assert third["status"] == "no_fix"
    assert third["reasons"] == ["3 inliers, 8 are needed"]


def test_errors_are_told_where_there_is_a_truth(features):
    errors = [feature["properties"].get("error_m", "none told") for feature in features["fix"][:4]]
    # A hundredth of a degree of latitude: pi / 18000 of the radius.
    assert errors[0] == pytest.approx(math.pi / 18_000 * 6_371_008.8)
    assert errors[1:3] == ["none told", None]
    assert errors[3] == pytest.approx(0, abs=1e-6)
    truths = {feature["properties"]["query"]: feature["geometry"]["coordinates"] for feature in features["truth"]}
    assert truths == {"1": [179.97, -17.91], "3": [179.99, -17.9], SHOWN: [-179.985, -17.91]}


def doubled_area(ring):
    return sum(x * next_y - next_x * y for (x, y), (next_x, next_y) in pairwise(ring))


def test_footprints_are_cut_and_counter_clockwise(features):
    assert [feature["properties"]["query"] for feature in features["footprint"]] == ["2", SHOWN]
    for feature in features["footprint"]:
        assert feature["geometry"]["type"] == "MultiPolygon"
        rings = [ring for polygon in feature["geometry"]["coordinates"] for ring in polygon]
        assert len(rings) == 2
        assert all(ring[0] == ring[-1] for ring in rings)
        assert [doubled_area(ring) for ring in rings] == pytest.approx([2 * 0.02 * 0.02] * 2)
        assert {x for ring in rings for x, _ in ring} == {-180, -179.98, 179.98, 180}


def test_the_track_is_cut_at_the_antimeridian_and_where_it_is_lost(features):
    first, second = features["track"]
    assert first["geometry"]["type"] == "MultiLineString"
    west, east = first["geometry"]["coordinates"]
    # Half-way between the second and the fourth picture.
    assert west == [[179.97, -17.9], [179.985, -17.905], [180, -17.9075]]
    assert east == [[-180, -17.9075], [-179.985, -17.91]]
    assert second["geometry"] == {"type": "LineString", "coordinates": [[-179.96, -17.92], [-179.95, -17.93]]}
    assert (second["properties"]["first"], second["properties"]["last"]) == ("7", "8")


def test_a_plain_footprint_is_one_polygon(tmp_path):
    corners = ((1.0, 10.0), (1.0, 12.0), (0.0, 12.0), (0.0, 10.0))
    write_geojson(tmp_path / "a.geojson", [fix(footprint=corners), lost(footprint=corners)])
    features = json.loads((tmp_path / "a.geojson").read_text())["features"]
    (polygon,) = [feature["geometry"] for feature in features if feature["properties"]["kind"] == "footprint"]
    assert polygon["type"] == "Polygon"
    assert doubled_area(polygon["coordinates"][0]) == pytest.approx(4)


@pytest.mark.parametrize("fixes", [[], [lost()], [fix()]])
def test_short_flights_have_no_track(tmp_path, fixes):
    write_geojson(tmp_path / "a.geojson", fixes)
    features = json.loads((tmp_path / "a.geojson").read_text())["features"]
    assert [feature["properties"]["kind"] for feature in features] == ["fix"] * len(fixes)


def test_numbers_that_are_not_finite_are_null(tmp_path):
    write_geojson(tmp_path / "a.geojson", [fix(sigma_m=math.inf, heading_deg=math.nan, latitude=math.nan)])
    (feature,) = json.loads((tmp_path / "a.geojson").read_text(), parse_constant=pytest.fail)["features"]
    assert feature["geometry"] is None
    assert feature["properties"]["sigma_m"] is feature["properties"]["heading_deg"] is None
