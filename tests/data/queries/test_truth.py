"""Where truth comes from: a given table, the tables beside the photos, EXIF, or nowhere."""

from pathlib import Path

import pytest
from PIL import Image

from diffnav.data.queries.truth import Truth, read_truth
from diffnav.errors import UserError

HEADER = "filename,lat,lon\n"


def photo(path: Path, gps: bool = False, time: bool = False) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    exif = Image.Exif()
    if gps:
        exif.get_ifd(0x8825).update({1: "N", 2: (10.0, 30.0, 0.0), 3: "E", 4: (20.0, 0.0, 0.0), 17: 90.0})
    if time:
        exif.get_ifd(0x8769).update({36867: "2024:10:30 10:05:15", 41989: 24})
    Image.new("RGB", (8, 8)).save(path, exif=exif)
    return path


@pytest.fixture
def three(tmp_path: Path) -> dict[str, Path]:
    return {
        "a": photo(tmp_path / "a.jpg", gps=True, time=True),
        "b": photo(tmp_path / "b.jpg"),
        "x/c": photo(tmp_path / "x" / "c.jpg"),
    }


def places(truths: dict[str, Truth]) -> dict[str, tuple[float, float] | None]:
    return {name: truth.place for name, truth in truths.items()}


def test_auto_without_tables_is_exif(three, tmp_path):
    truths, problems = read_truth(three, root=tmp_path)
    assert places(truths) == {"a": (10.5, 20), "b": None, "x/c": None}
    assert truths["a"].heading_deg == 90
    assert problems == ["2 of 3 photos have no truth (EXIF holds no GPS position), the first is b"]
    _, problems = read_truth({"b": three["b"]})
    assert problems == ["b: no truth (EXIF holds no GPS position)"]


def test_auto_takes_the_table_beside_or_above(three, tmp_path):
    (tmp_path / "places.csv").write_text(HEADER + "a.jpg,1,2\nc.jpg,5,6\n")
    truths, problems = read_truth(three, "auto", root=tmp_path)
    assert places(truths) == {"a": (1, 2), "b": None, "x/c": (5, 6)}
    # What the table does not say comes from EXIF, but never half a place.
    assert truths["a"].heading_deg == 90
    assert truths["a"].time.year == 2024
    assert problems == ["b: no truth (EXIF holds no GPS position)"]
    # The nearest one counts; above the root none is looked for.
    (tmp_path / "x" / "near.txt").write_text("filename lon lat\nc.jpg 8 7\n")
    assert read_truth(three, "auto", root=tmp_path)[0]["x/c"].place == (7, 8)
    (tmp_path / "x" / "near.txt").unlink()
    assert read_truth(three, "auto")[0]["x/c"].place is None


def test_auto_prefers_the_usual_name(three, tmp_path):
    (tmp_path / "other.csv").write_text(HEADER + "a.jpg,1,2\n")
    (tmp_path / "notes.txt").write_text("flown on a sunny day\n")
    (tmp_path / "map.csv").write_text("Filename,Top_left_lat,Top_left_lon,Bottom_right_lat,Bottom_right_long\n")
    (tmp_path / "photo_metadata.csv").write_text("Filename,Latitude,Longitude,Altitude\na.jpg,3,4,100\n")
    truths, _ = read_truth(three, "auto", root=tmp_path)
    assert truths["a"].place == (3, 4)
    # 24 mm on 36 mm film over 8 pixels at 100 m.
    assert truths["a"].ground_sample_distance_m == pytest.approx(100 * 36 / 24 / 8)
    (tmp_path / "photo_metadata.csv").rename(tmp_path / "third.csv")
    with pytest.raises(UserError, match=r"other\.csv and .*third\.csv both list places of photos; name .*truth=FILE"):
        read_truth(three, "auto", root=tmp_path)


def test_a_given_table_alone_gives_places(three, tmp_path):
    path = tmp_path / "elsewhere.csv"
    path.write_text(HEADER + "b.jpg,1,2\nz.jpg,1,2\n")
    truths, problems = read_truth(three, path)
    assert places(truths) == {"a": None, "b": (1, 2), "x/c": None}
    assert truths["a"].time.year == 2024
    assert problems == [
        f"{path}: names a picture that is not there (z.jpg)",
        f"2 of 3 photos have no truth ({path} does not name it with a place), the first is a",
    ]


def test_none_gives_no_place_and_no_problem(three):
    truths, problems = read_truth(three, "none")
    assert places(truths) == {"a": None, "b": None, "x/c": None}
    assert (truths["a"].heading_deg, truths["a"].time.year) == (90, 2024)
    assert problems == []


def test_mistakes_are_one_sentence(three, tmp_path):
    with pytest.raises(UserError, match=r"no file .*gone\.csv: truth is auto, none, or a table"):
        read_truth(three, tmp_path / "gone.csv")
    (tmp_path / "t.csv").write_text(HEADER + "z.jpg,1,2\n")
    with pytest.raises(UserError, match=r"t\.csv: gives no place for any of the 3 photos; the first problem: .*z\.jpg"):
        read_truth(three, tmp_path / "t.csv")
    with pytest.raises(UserError, match="columns belong to a table"):
        read_truth(three, "auto", {"name": 1, "latitude": 2, "longitude": 3})
