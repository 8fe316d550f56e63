"""What photos' own tags say: EXIF GPS with its missing pieces, time, heading, DJI's XMP."""

from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest
from PIL import Image
from PIL.TiffImagePlugin import IFDRational

from diffnav.data.queries.exif import exif_truth

# 24 degrees 15' 35.5834" N, 120 degrees 43' 17.0295" E, as a DJI Mini 2 writes them.
PLACE = {1: "N", 2: (24.0, 15.0, 35.5834), 3: "E", 4: (120.0, 43.0, 17.0295)}
DEGREES = (24 + 15 / 60 + 35.5834 / 3600, 120 + 43 / 60 + 17.0295 / 3600)


def photo(path: Path, gps: dict | None = None, camera: dict | None = None, main: dict | None = None) -> Path:
    exif = Image.Exif()
    exif.update(main or {})
    exif.get_ifd(0x8825).update(gps or {})
    exif.get_ifd(0x8769).update(camera or {})
    Image.new("RGB", (40, 20)).save(path, exif=exif)
    return path


@pytest.mark.parametrize(("south", "west"), [(False, False), (True, False), (False, True), (True, True)])
def test_position_and_its_signs(tmp_path, south, west):
    gps = {**PLACE, 1: "S" if south else "N", 3: "W" if west else "E"}
    truth, reason = exif_truth(photo(tmp_path / "a.jpg", gps))
    assert reason is None
    assert truth.place == pytest.approx((-DEGREES[0] if south else DEGREES[0], -DEGREES[1] if west else DEGREES[1]))


def test_degrees_alone_and_in_minutes(tmp_path):
    gps = {1: "n", 2: (60.5, 0.0, 0.0), 3: "w ", 4: (22.0, 30.75, 0.0)}
    assert exif_truth(photo(tmp_path / "a.jpg", gps))[0].place == pytest.approx((60.5, -22.5125))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({1: None, 2: None, 3: None, 4: None}, "EXIF holds no GPS position"),
        ({1: None}, "does not say whether its latitude is N or S"),
        ({3: None}, "does not say whether its longitude is E or W"),
        ({3: "X"}, "does not say whether its longitude is E or W"),
        ({4: None}, "lacks a readable longitude"),
        ({2: (IFDRational(0, 0), IFDRational(0, 0), IFDRational(0, 0))}, "lacks a readable latitude"),
        ({9: "V"}, "recorded without a fix"),
        ({2: (91.0, 0.0, 0.0)}, "no place on the earth"),
        ({2: (0.0, 0.0, 0.0), 4: (0.0, 0.0, 0.0)}, "is 0, 0"),
    ],
)
def test_missing_pieces(tmp_path, change, reason):
    gps = {tag: value for tag, value in {**PLACE, **change}.items() if value is not None}
    truth, found = exif_truth(photo(tmp_path / "a.jpg", gps, {36867: "2024:10:30 10:05:15"}))
    assert truth.place is None
    assert reason in found
    assert truth.time == datetime(2024, 10, 30, 10, 5, 15)


def test_altitude_above_the_sea_is_no_height(tmp_path):
    assert exif_truth(photo(tmp_path / "a.jpg", {**PLACE, 5: b"\0", 6: 376.3}))[0].height_m is None


def test_heading(tmp_path):
    assert exif_truth(photo(tmp_path / "a.jpg", {**PLACE, 16: "T", 17: 271.5}))[0].heading_deg == 271.5
    assert exif_truth(photo(tmp_path / "b.jpg", {17: 360.0}))[0].heading_deg == 0
    assert exif_truth(photo(tmp_path / "c.jpg", PLACE))[0].heading_deg is None


def test_time(tmp_path):
    camera = {36867: "2024:10:30 10:05:15", 37521: "25", 36881: "+08:00"}
    expected = datetime(2024, 10, 30, 10, 5, 15, 250_000, timezone(timedelta(hours=8)))
    assert exif_truth(photo(tmp_path / "a.jpg", camera=camera))[0].time == expected
    # When the file was changed, where nothing better is there.
    assert exif_truth(photo(tmp_path / "b.jpg", main={306: "2014:10:19 13:21:37"}))[0].time.year == 2014
    assert exif_truth(photo(tmp_path / "c.jpg", camera={36867: "    :  :     :  :  "}))[0].time is None


def test_what_a_pixel_sees(tmp_path):
    """24 mm on 36 mm film: at 100 m the longer side, here 40 pixels, is 150 m wide."""
    truth, _ = exif_truth(photo(tmp_path / "a.jpg", camera={41989: 24}))
    assert truth.pixel_angle_rad * 100 * 40 == pytest.approx(150)
    assert truth.ground_sample_distance_m is None
    assert exif_truth(photo(tmp_path / "b.jpg", camera={41989: 0}))[0].pixel_angle_rad is None


@pytest.mark.parametrize(
    "xmp",
    [
        b'<rdf:Description drone-dji:RelativeAltitude="+119.98" drone-dji:GimbalYawDegree="-4.70"/>',
        b"<drone-dji:RelativeAltitude>119.98</drone-dji:RelativeAltitude>"
        b"<drone-dji:GimbalYawDegree>-4.70</drone-dji:GimbalYawDegree>",
    ],
)
def test_dji(tmp_path, xmp):
    plain = photo(tmp_path / "a.jpg", PLACE).read_bytes()
    block = b"http://ns.adobe.com/xap/1.0/\0" + xmp
    (tmp_path / "b.jpg").write_bytes(plain[:2] + b"\xff\xe1" + (len(block) + 2).to_bytes(2, "big") + block + plain[2:])
    truth, _ = exif_truth(tmp_path / "b.jpg")
    assert truth.height_m == 119.98
    assert truth.heading_deg == pytest.approx(355.3)
    assert truth.place is not None


def test_files_without_tags(tmp_path):
    Image.new("RGB", (4, 4)).save(tmp_path / "a.png")
    assert exif_truth(tmp_path / "a.png")[1] == "EXIF holds no GPS position"
    (tmp_path / "b.jpg").write_text("no picture")
    for name in ("b.jpg", "gone.jpg"):
        truth, reason = exif_truth(tmp_path / name)
        assert (truth.place, truth.time, reason) == (None, None, "tags cannot be read")
