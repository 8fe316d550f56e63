"""Tables of coordinates: separators, names of columns, damaged headers."""

from pathlib import Path

import pytest

from diffnav.data.coordinate_tables import plain_name, read_table
from diffnav.errors import UserError


def written(folder: Path, text: str, encoding: str = "utf-8") -> Path:
    (folder / "t.csv").write_text(text, encoding=encoding)
    return folder / "t.csv"


@pytest.mark.parametrize(
    "text",
    [
        'Filename, Lat,Lon\n"a b.jpg",   1.5,    -2\n\nc.jpg,3,4\n',
        "Filename;Lat;Lon\r\na b.jpg;1,5;-2\r\n;;\r\nc.jpg;3;4",
        "Filename\tLat\tLon\na b.jpg\t1.5\t-2\n  \nc.jpg\t3\t4\n",
        'Filename  Lat   Lon \n"a b.jpg"   1.5 -2\n\n c.jpg 3 4\n',
    ],
)
def test_whatever_parts_the_cells(tmp_path, text):
    table = read_table(written(tmp_path, text))
    assert table.header[:3] == ["Filename", "Lat", "Lon"]
    assert [line for line, _ in table.rows] == [2, 4]
    assert [cells[0] for _, cells in table.rows] == ["a b.jpg", "c.jpg"]
    assert [[table.number(cell) for cell in cells[1:3]] for _, cells in table.rows] == [[1.5, -2], [3, 4]]


def test_names_of_columns():
    names = ["Bottom_right_long", "bottom right LONGITUDE", "Lower-Right Lon"]
    assert {plain_name(name) for name in names} == {"bottomrightlon"}
    assert plain_name("GPS Latitude") == "gpslat"


def test_columns_by_name_the_first_choice_first(tmp_path):
    table = read_table(written(tmp_path, "\ufeffyaw,Name,Gimbal_Yaw\n1,a,2\n"))
    assert table.column(("gimbalyaw", "yaw")) == 2
    assert table.columns({"name": ("file", "name"), "heading": ("yaw",), "time": ("time",)}) == {
        "name": 1,
        "heading": 0,
    }


def test_no_numbers(tmp_path):
    table = read_table(written(tmp_path, "a,b\n1,2\n"))
    assert [table.number(cell) for cell in ("", "north", "nan", "inf", "1,5", "24° 15'")] == [None] * 6
    table.require_header_apart()


@pytest.mark.parametrize(
    "header", ['Filename, Top_left_lat,Bottom_right_long"sat_00.jpg", 60.4, 22.4', "filename lon lat0.jpg 38.2 55.5"]
)
def test_header_glued_to_the_first_row(tmp_path, header):
    table = read_table(written(tmp_path, f"{header}\n"))
    with pytest.raises(UserError, match=r"t\.csv: its first line holds numbers .*header and first row are glued"):
        table.require_header_apart()


def test_encodings_of_spreadsheets(tmp_path):
    for encoding in ("utf-8", "utf-8-sig", "utf-16"):
        table = read_table(written(tmp_path, "Datei,höhe\nä.jpg,2\n", encoding))
        assert table.header == ["Datei", "höhe"]
        assert table.rows == [(2, ["ä.jpg", "2"])]
    assert read_table(written(tmp_path, "a,b\n1,2\n"), first_line_only=True).rows == []


def test_what_is_no_table(tmp_path):
    assert read_table(written(tmp_path, "")).header == []
    with pytest.raises(UserError, match="line 1: is no line of a table"):
        read_table(written(tmp_path, "a," + "x" * 200_000))
    with pytest.raises(UserError, match=r"gone\.csv: cannot be read"):
        read_table(tmp_path / "gone.csv")
