import xml.etree.ElementTree as ET
from datetime import datetime

import pytest
from example_fixes import NASTY, fix, flight, lost

from diffnav.navigation.exports.gpx import write_gpx

SPACE = {"g": "http://www.topografix.com/GPX/1/1"}
# The order of GPX 1.1's wptType, of what is used here.
ORDER = ["time", "name", "src", "type", "fix", "hdop"]


@pytest.fixture
def root(tmp_path):
    write_gpx(tmp_path / "track.gpx", flight(), name="flight <1>")
    return ET.parse(tmp_path / "track.gpx").getroot()


def names(root):
    return [
        [p.find("g:name", SPACE).text for p in s.findall("g:trkpt", SPACE)] for s in root.iterfind(".//g:trkseg", SPACE)
    ]


def test_it_is_a_gpx_1_1_track(root):
    assert root.tag == f"{{{SPACE['g']}}}gpx"
    assert root.get("version") == "1.1"
    assert root.get("creator")
    assert root.find("g:trk/g:name", SPACE).text == "flight <1>"


def test_one_lost_picture_is_bridged_and_two_end_the_segment(root):
    shown = NASTY.replace("\x07", "\ufffd").replace("\udc80", "\ufffd")
    assert names(root) == [["1", "2", shown], ["7", "8"]]


def test_points_carry_place_time_and_error(root):
    points = root.findall(".//g:trkpt", SPACE)
    assert [(float(p.get("lat")), float(p.get("lon"))) for p in points] == [
        (-17.9, 179.97), (-17.905, 179.985), (-17.91, -179.985), (-17.92, -179.96), (-17.93, -179.95),
    ]  # fmt: skip
    for point in points:
        tags = [child.tag.split("}")[1] for child in point]
        assert tags == [tag for tag in ORDER if tag in tags]
    children = [{child.tag.split("}")[1]: child.text for child in point} for point in points]
    assert {child["time"] for child in children if "time" in child} == {"2024-05-06T23:59:59.450Z"}
    assert [child["fix"] for child in children] == ["2d", "2d", "2d", "none", "2d"]
    assert children[0]["src"] == "Fiji"
    assert float(children[3]["hdop"]) == pytest.approx(2**0.5 * 25 / 5, abs=0.01)
    assert "hdop" not in children[2]


def test_numbers_are_plain_decimals_and_180_is_minus_180(tmp_path):
    write_gpx(tmp_path / "a.gpx", [fix(latitude=1e-7, longitude=180.0), fix(latitude=0, longitude=179.9999999999)])
    text = (tmp_path / "a.gpx").read_text()
    assert 'lat="0.00000010" lon="-180.00000000"' in text
    assert text.count('lon="-180.00000000"') == 2


@pytest.mark.parametrize("fixes", [[], [lost(), lost()]])
def test_no_fix_at_all_is_a_valid_file(tmp_path, fixes):
    write_gpx(tmp_path / "a.gpx", fixes)
    assert names(ET.parse(tmp_path / "a.gpx").getroot()) == []


def test_a_time_without_zone_is_taken_as_utc(tmp_path):
    write_gpx(tmp_path / "a.gpx", [fix(time=datetime(2023, 12, 31, 23, 0))])
    assert ET.parse(tmp_path / "a.gpx").getroot().find(".//g:time", SPACE).text == "2023-12-31T23:00:00.000Z"
