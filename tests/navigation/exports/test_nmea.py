import math
import re
from datetime import datetime, timedelta, timezone

import pytest
from example_fixes import fix, flight, lost

from diffnav.errors import UserError
from diffnav.navigation.exports.nmea import checksum, gga, hdop, write_nmea


def fields(sentence):
    assert re.fullmatch(r"\$[^*$]+\*[0-9A-F]{2}", sentence)
    return sentence[1:-3].split(",")


def degrees(text, side, digits):
    value = int(text[:digits]) + float(text[digits:]) / 60
    return -value if side in "SW" else value


@pytest.mark.parametrize(
    "sentence",
    [
        # From manuals of receivers.
        "$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47",
        "$GPGGA,172814.0,3723.46587704,N,12202.26957864,W,2,6,1.2,18.893,M,-25.669,M,2.0,0031*4F",
    ],
)
def test_the_checksum_of_published_sentences(sentence):
    body, expected = sentence[1:].split("*")
    assert checksum(body) == int(expected, 16)


def test_a_fix():
    sentence = gga(fix(latitude=48.1173, longitude=-11.5166666667, sigma_m=5.0, time=datetime(2024, 1, 2, 3, 4, 5)))
    values = fields(sentence)
    assert len(values) == 15
    assert checksum(sentence[1:-3]) == int(sentence[-2:], 16)
    assert values[:2] == ["GPGGA", "030405.00"]
    assert values[2:6] == ["4807.038000", "N", "01131.000000", "W"]
    assert values[6:8] == ["1", "00"]
    assert values[8] == "1.4"
    assert len(sentence) + 2 <= 82


@pytest.mark.parametrize("place", [(-0.000001, 0.000001), (89.9999999, -179.9999999), (-33.123456789, 151.987654321)])
def test_places_are_kept_to_a_centimetre(place):
    values = fields(gga(fix(latitude=place[0], longitude=place[1])))
    latitude, longitude = degrees(values[2], values[3], 2), degrees(values[4], values[5], 3)
    assert abs(latitude - place[0]) * 111_195 < 0.01
    assert abs(longitude - place[1]) * 111_195 < 0.01


def test_minutes_never_reach_sixty():
    values = fields(gga(fix(latitude=9.99999999999, longitude=-0.99999999999)))
    assert values[2:6] == ["1000.000000", "N", "00100.000000", "W"]


def test_longitudes_beyond_180_come_back():
    assert fields(gga(fix(longitude=181.0)))[4:6] == ["17900.000000", "W"]
    assert fields(gga(fix(longitude=180.0)))[4] == "18000.000000"


def test_quality_of_coasted_and_lost():
    coasted = fields(gga(fix(status="coasted", sigma_m=1e9)))
    assert coasted[6] == "6"
    assert coasted[8] == "99.9"
    for nowhere in (lost(), fix(status="no_fix"), fix(latitude=None), fix(longitude=math.nan), fix("a", None, None)):
        values = fields(gga(nowhere))
        assert values[2:6] == ["", "", "", ""]
        assert values[6] == "0"
        assert values[8] == ""


def test_times_are_utc_or_empty():
    zone = timezone(timedelta(hours=-3))
    assert fields(gga(lost(time=datetime(2024, 1, 1, 22, 30, tzinfo=zone))))[1] == "013000.00"
    assert fields(gga(lost()))[1] == ""


def test_hdop_is_the_horizontal_error_over_five_metres():
    assert hdop(fix(sigma_m=3.0)) == pytest.approx(math.hypot(3.0, 3.0) / 5)
    assert hdop(fix(sigma_m=None)) is None
    assert hdop(fix(sigma_m=math.inf)) is None


def test_a_file_has_one_line_a_picture(tmp_path):
    write_nmea(tmp_path / "new" / "track.nmea", flight())
    lines = (tmp_path / "new" / "track.nmea").read_bytes().split(b"\r\n")
    assert lines.pop() == b""
    assert [line.decode().split(",")[6] for line in lines] == ["1", "1", "0", "1", "0", "0", "6", "1"]
    assert lines[1].split(b",")[1] == lines[0].split(b",")[1]


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"track\.nmea: cannot be written"):
        write_nmea(tmp_path / "file" / "track.nmea", [])
