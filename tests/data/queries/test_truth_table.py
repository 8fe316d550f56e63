"""Tables of truth: recognised and stated columns, and rows that do not fit."""

from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest

from diffnav.data.queries.truth_table import is_truth_table, table_truth
from diffnav.errors import UserError

WILDNAV = (
    "Filename,Latitude,Longitude,Altitude,Gimball_Roll,Gimball_Yaw,Gimball_Pitch,Flight_Roll,Flight_Yaw,Flight_Pitch\n"
)
ROW_1 = "a1.jpg,60.40324,22.46213,+119.98,+0.00,-4.70,-90.30,-8.50,+1.60,-11.00\n"
ROW_2 = "a2.jpg,60.40225,22.46515,+120.01,+0.00,-92.60,-90.30,-1.00,-86.80,-10.90\n"


def photos(folder: Path, *names: str) -> dict[str, Path]:
    return {name.rsplit(".", 1)[0]: folder / name for name in names}


def table(folder: Path, text: str, name: str = "t.csv") -> Path:
    (folder / name).write_text(text)
    return folder / name


def test_wildnav(tmp_path):
    found, problems = table_truth(table(tmp_path, WILDNAV + ROW_1 + ROW_2), photos(tmp_path, "a1.jpg", "a2.jpg"))
    assert problems == []
    assert [truth.place for truth in found.values()] == [(60.40324, 22.46213), (60.40225, 22.46515)]
    assert found["a1"].height_m == 119.98
    # The camera's yaw, not the craft's.
    assert [truth.heading_deg for truth in found.values()] == pytest.approx([355.3, 267.4])


def test_longitude_first(tmp_path):
    text = "filename lon lat\n0.jpg 38.246245 55.542349\n1.jpg 46.042279 38.171986\n"
    found, _ = table_truth(table(tmp_path, text, "queries.txt"), photos(tmp_path, "0.jpg", "1.jpg"))
    assert [truth.place for truth in found.values()] == [(55.542349, 38.246245), (38.171986, 46.042279)]


def test_uav_visloc(tmp_path):
    text = (
        "num,filename,date,lat,lon,height,Omega,Kappa,Phi1,Phi2\n"
        "1,01_0001.JPG,2018-04-20T09:41:20.500+08:00,29.77,115.96,406.5,-0.9,1.8,-125.5,-124.0\n"
    )
    found, _ = table_truth(table(tmp_path, text), photos(tmp_path, "drone/01_0001.JPG"))
    truth = found["drone/01_0001"]
    assert (truth.place, truth.height_m, truth.heading_deg) == ((29.77, 115.96), 406.5, 234.5)
    assert truth.time == datetime(2018, 4, 20, 9, 41, 20, 500_000, timezone(timedelta(hours=8)))


def test_stated_columns_by_header_or_number(tmp_path):
    path = table(tmp_path, "Bild;y;x;kurs\na1.jpg;60,5;22,5;-90\n")
    columns = {"name": "Bild", "latitude": "y", "longitude": "x", "heading_deg": 4}
    found, _ = table_truth(path, photos(tmp_path, "a1.jpg"), columns)
    assert (found["a1"].place, found["a1"].heading_deg, found["a1"].height_m) == ((60.5, 22.5), 270, None)
    headless = table(tmp_path, "22.5,60.5,a1.jpg\n22.6,60.6,a2.jpg\n")
    found, problems = table_truth(
        headless, photos(tmp_path, "a1.jpg", "a2.jpg"), {"name": 3, "latitude": 2, "longitude": 1}
    )
    assert [truth.place for truth in found.values()] == [(60.5, 22.5), (60.6, 22.6)]
    assert problems == []


@pytest.mark.parametrize("name", ["a1.jpg", "A1.JPG", "./a1.jpg", "a1", "old\\place\\a1.jpg", "a1.png"])
def test_rows_name_files_in_many_ways(tmp_path, name):
    found, problems = table_truth(table(tmp_path, WILDNAV + ROW_1.replace("a1.jpg", name)), photos(tmp_path, "a1.jpg"))
    assert list(found) == ["a1"]
    assert problems == []


def test_one_name_in_two_folders(tmp_path):
    both = photos(tmp_path, "x/a1.jpg", "y/a1.jpg")
    found, problems = table_truth(table(tmp_path, WILDNAV + ROW_1), both)
    assert found == {}
    assert "line 2: a1.jpg is 2 files (x/a1, y/a1); write its folder too" in problems[0]
    found, problems = table_truth(table(tmp_path, WILDNAV + ROW_1.replace("a1", "y/a1")), both)
    assert list(found) == ["y/a1"]


def test_rows_that_do_not_fit_are_told_and_passed_over(tmp_path):
    text = (
        WILDNAV + ROW_1 + ROW_1.replace("60.4", "61.4") + "a2.jpg,,22.4\n" + "a3.jpg,95,100\n" + "gone.jpg,1,2\n"
        "gone2.jpg,1,2\n" + "a2.jpg,north,22.4\n" + "a4.jpg,1,400\n" + "a5.jpg,-33.5,190\n"
    )
    found, problems = table_truth(table(tmp_path, text), photos(tmp_path, *(f"a{n}.jpg" for n in range(1, 6))))
    assert list(found) == ["a1", "a5"]
    assert found["a1"].place == (60.40324, 22.46213)
    assert found["a5"].place == (-33.5, -170)
    assert [problem.split("t.csv")[1] for problem in problems] == [
        " line 3: names a1.jpg again; its first line counts",
        " line 4: '', '22.4' are no latitude and longitude in degrees",
        " line 5: 95, 100 is no latitude and longitude in degrees",
        ": 2 more lines with such mistakes",
        ": names 2 pictures that are not there (gone.jpg)",
    ]


@pytest.mark.parametrize(
    ("text", "columns", "reason"),
    [
        ("filename,lat,lon\na1.jpg,120.7,24.2\n", None, r"line 2: latitude 120\.7 .* look exchanged; .*columns=\{name"),
        (WILDNAV.strip() + ROW_1, None, "header and first row are glued together"),
        ("file,x,y\na1.jpg,1,2\n", None, r"cannot tell its columns \(file, x, y\); say .* columns=\{name"),
        ("file,x,y\na1.jpg,1,2\n", {"name": "file", "latitude": "y"}, "it needs name, latitude, longitude"),
        ("file,x,y\n", {"name": "file", "latitude": "y", "longitude": "x", "speed": "v"}, "may have height_m"),
        ("file,x,y\n", {"name": "file", "latitude": "y", "longitude": "z"}, r"has no column 'z' .*it has file, x, y"),
        ("file,x,y\n", {"name": "file", "latitude": "y", "longitude": 0}, "must be a number from 1"),
    ],
)
def test_mistakes_are_one_sentence(tmp_path, text, columns, reason):
    with pytest.raises(UserError, match=reason) as caught:
        table_truth(table(tmp_path, text), photos(tmp_path, "a1.jpg"), columns)
    assert "\n" not in str(caught.value)


def test_recognition(tmp_path):
    for header, expected in (
        (WILDNAV, True),
        ("filename lon lat\n", True),
        ("SourceFile,GPSLatitude,GPSLongitude\n", True),
        ("Filename,Top_left_lat,Top_left_lon,Bottom_right_lat,Bottom_right_long\n", False),
        ("x,y,z\n", False),
        ("", False),
    ):
        assert is_truth_table(table(tmp_path, header)) is expected
