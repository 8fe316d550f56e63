"""Maps listed in tables: the known headers, and what rows can have wrong."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from diffnav.data.maps.coordinate_system import CoordinateSystem
from diffnav.data.maps.tables import is_map_table, table_maps
from diffnav.errors import UserError
from diffnav.images import ImageError

WILDNAV = "Filename, Top_left_lat,Top_left_lon,Bottom_right_lat,Bottom_right_long\n"
ROW_A = '"a.png",   60.404,    22.460,   60.402,    22.464\n'
ROW_B = '"b.png",  60.404,  22.464,  60.402,  22.468\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for level, name in enumerate(("a.png", "b.png", "deep/c.png")):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        Image.fromarray(np.full((20, 40, 3), 50 * level, np.uint8)).save(tmp_path / name)
    return tmp_path


def table(folder: Path, text: str, name: str = "map.csv") -> Path:
    (folder / name).write_text(text)
    return folder / name


def check_a(found) -> None:
    """a.png: 20 x 40 pixels over .002 degrees of latitude and .004 of longitude."""
    assert found.size == (20, 40)
    np.testing.assert_allclose(found.georeference.latlon([0, 0]), [60.40395, 22.46005], atol=1e-10)
    np.testing.assert_allclose(found.georeference.latlon([39, 19]), [60.40205, 22.46395], atol=1e-10)


@pytest.mark.parametrize(
    "text",
    [
        WILDNAV + ROW_A,
        "filename top_left_lat top_left_lon bottom_right_lat bottom_right_lon\na.png 60.404 22.46 60.402 22.464\n",
        "mapname,LT_lat_map,LT_lon_map,RB_lat_map,RB_lon_map,region\na.png,60.404,22.46,60.402,22.464,Turku\n",
        "east,west,north,south,name\n22.464,22.46,60.404,60.402,a.png\n",
        "file;north;west;south;east\na.png;60,404;22,46;60,402;22,464\n",
        "name,tl_lat,tl_lon,tr_lat,tr_lon,br_lat,br_lon,bl_lat,bl_lon\n"
        "a.png,60.404,22.46,60.404,22.464,60.402,22.464,60.402,22.46\n",
    ],
)
def test_known_headers(folder, text):
    path = table(folder, text)
    assert is_map_table(path)
    (found,) = table_maps(path)
    assert found.name == "a"
    check_a(found)


def test_many_tiles_in_the_tables_order(folder):
    text = WILDNAV + ROW_B + ROW_A + '"deep/c.png", 60.402, 22.46, 60.400, 22.464\n'
    found = table_maps(table(folder, text))
    assert [item.name for item in found] == ["b", "a", "deep/c"]
    assert [round(float(item.read((0, 0, 1, 1)).mean()) * 255) for item in found] == [50, 0, 100]
    assert len({item.fingerprint for item in found}) == 3
    check_a(found[1])
    assert [item.name for item in table_maps(table(folder, text), only="a.png")] == ["a"]


def test_pictures_in_folders_below(folder):
    """UAV-VisLoc lists satellite01.tif, which lies in the folder 01."""
    header = "mapname,LT_lat_map,LT_lon_map,RB_lat_map,RB_lon_map,region\n"
    (found,) = table_maps(table(folder, header + "c.png,60.404,22.46,60.402,22.464,Turku\n"))
    assert round(float(found.read((0, 0, 1, 1)).mean()) * 255) == 100
    (folder / "other").mkdir()
    (folder / "other" / "c.png").write_bytes((folder / "deep" / "c.png").read_bytes())
    with pytest.raises(UserError, match=r"line 2: c\.png is 2 files .*write its folder too"):
        table_maps(folder / "map.csv")


def test_four_corners(folder):
    header = "name,tl_lat,tl_lon,tr_lat,tr_lon,br_lat,br_lon,bl_lat,bl_lon\n"
    turned = "a.png,50,8,50.01,8.02,50.0,8.03,49.99,8.01\n"
    (found,) = table_maps(table(folder, header + turned))
    np.testing.assert_allclose(found.georeference.latlon([39.5, -0.5]), [50.01, 8.02], atol=1e-10)
    np.testing.assert_allclose(found.georeference.latlon([-0.5, 19.5]), [49.99, 8.01], atol=1e-10)


def test_even_in_web_mercator(folder):
    path = table(folder, WILDNAV + '"a.png", 60, 0, 0, 60\n')
    (even,) = table_maps(path, CoordinateSystem("EPSG:3857"))
    assert even.georeference.latlon([0, 9.5])[0] == pytest.approx(
        np.degrees(np.arctan(np.sinh(np.arcsinh(3**0.5) / 2)))
    )
    with pytest.raises(UserError, match=r"maps\.crs=EPSG:25832: .* EPSG:4326 or EPSG:3857"):
        table_maps(path, CoordinateSystem("EPSG:25832"))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        # As wildnav's own file has been seen.
        (
            WILDNAV.strip() + ROW_A + ROW_B,
            r"map\.csv: its first line holds numbers .* glued together; put a line break",
        ),
        (WILDNAV + ROW_A + ROW_A, r"line 3: names a\.png again"),
        (WILDNAV + ROW_A.replace("60.402", ""), r"line 2: Bottom_right_lat is '', no number"),
        (WILDNAV + '"a.png", 60.404, 22.46, 60.402\n', r"line 2: Bottom_right_long is '', no number"),
        (WILDNAV + ROW_A.replace("60.402", "south"), r"line 2: Bottom_right_lat is 'south', no number"),
        (WILDNAV + ROW_A + ROW_B.replace("b.png", "z.png"), r"line 3: no such file .*z\.png"),
        (WILDNAV + ", 60.404, 22.46, 60.402, 22.464\n", "line 2: names no picture"),
        (WILDNAV + '"a.png", 60.402, 22.46, 60.404, 22.464\n', r"line 2 \(a\.png\): north 60\.402 lies below south"),
        (WILDNAV + '"a.png", 22.460, 60.404, 22.464, 60.402\n', r"line 2 \(a\.png\): north .* lies below south"),
        (
            WILDNAV + '"a.png", 120.7, 24.26, 120.6, 24.27\n',
            r"\(a\.png\): the latitude 120\.7 .* latitude stands first",
        ),
        (WILDNAV, "lists no map"),
        ("Filename,Latitude,Longitude\na.png,1,2\n", "is no table of maps, its header lacks north, west, south, east"),
        ("", "lacks file name, north"),
    ],
)
def test_mistakes_are_one_sentence(folder, text, reason):
    with pytest.raises(UserError, match=reason) as caught:
        table_maps(table(folder, text))
    assert "\n" not in str(caught.value)


def test_unreadable_pictures(folder):
    (folder / "b.png").write_text("no picture")
    with pytest.raises(ImageError, match=r"b\.png: not an image"):
        table_maps(table(folder, WILDNAV + ROW_A + ROW_B))


def test_what_is_no_table_of_maps(folder):
    for text in ("Filename,Latitude,Longitude\n", "notes\n", "", "1 2 3 4 5\n"):
        assert not is_map_table(table(folder, text, "other.txt"))
    assert is_map_table(table(folder, WILDNAV.strip() + ROW_A))
