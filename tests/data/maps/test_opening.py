"""The one door to maps."""

import builtins
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from diffnav.data.maps.opening import open_maps
from diffnav.errors import UserError
from diffnav.images import ImageError

TABLE = "Filename,Top_left_lat,Top_left_lon,Bottom_right_lat,Bottom_right_long\na.png,60.404,22.46,60.402,22.464\n"
DEGREES = "0.0001\n0\n0\n-0.0002\n22.46\n60.4\n"
CORNERS = [[60.404, 22.46], [60.404, 22.464], [60.402, 22.464], [60.402, 22.46]]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("a.png", "b.png"):
        Image.fromarray(np.zeros((20, 40, 3), np.uint8)).save(tmp_path / name)
    return tmp_path


def first_pixel(found) -> list[float]:
    return found.georeference.latlon([0, 0]).round(9).tolist()


def test_a_table_and_its_folder(folder):
    (folder / "map.csv").write_text(TABLE)
    (folder / "notes.txt").write_text("nothing of maps")
    for path in (folder / "map.csv", folder, str(folder), folder / "a.png"):
        (found,) = open_maps(path)
        assert (found.name, first_pixel(found)) == ("a", [60.40395, 22.46005])
    (folder / "tiles.txt").write_text(TABLE)
    with pytest.raises(UserError, match=r"map\.csv and .*tiles\.txt both list maps; name the one"):
        open_maps(folder)


def test_a_folder_of_images(folder):
    (folder / "a.pgw").write_text(DEGREES)
    with pytest.raises(UserError, match=r"b\.png: nothing says where it lies; give maps\.bounds=.*world file.*table"):
        open_maps(folder)
    (folder / "b.pgw").write_text(DEGREES.replace("22.46", "22.47"))
    (folder / "deep").mkdir()
    Image.fromarray(np.zeros((20, 40, 3), np.uint8)).save(folder / "deep" / "a.jpg")
    (folder / "deep" / "a.jgw").write_text(DEGREES)
    assert {found.name: first_pixel(found)[1] for found in open_maps(folder)} == {
        "a": 22.46,
        "b": 22.47,
        "deep/a": 22.46,
    }
    assert [found.name for found in open_maps(folder / "b.png")] == ["b"]


def test_names_differ_where_files_differ_in_their_ending(folder):
    Image.fromarray(np.zeros((20, 40, 3), np.uint8)).save(folder / "a.jpg")
    for world in ("a.pgw", "b.pgw", "a.jgw"):
        (folder / world).write_text(DEGREES)
    assert [found.name for found in open_maps(folder)] == ["a.jpg", "a.png", "b"]


def test_places_given_by_the_user(folder):
    (folder / "a.pgw").write_text(DEGREES)
    for place in ({"bounds": [60.404, 22.46, 60.402, 22.464]}, {"corners": CORNERS}):
        (found,) = open_maps(folder / "a.png", **place)
        assert first_pixel(found) == [60.40395, 22.46005]
    (found,) = open_maps(folder / "a.png", bounds=(60, 0, 0, 60), crs="EPSG:3857")
    assert found.georeference.latlon([0, 9.5])[0] == pytest.approx(35.26, abs=0.01)
    (folder / "b.png").unlink()
    assert len(open_maps(folder, corners=CORNERS)) == 1


def test_geotiff(folder):
    rasterio = pytest.importorskip("rasterio")
    pytest.importorskip("pyproj")
    transform = rasterio.Affine(1, 0, 5e5, 0, -1, 5e6)
    with rasterio.open(
        folder / "m.tif",
        "w",
        driver="GTiff",
        count=1,
        height=9,
        width=7,
        dtype="uint8",
        crs="EPSG:32632",
        transform=transform,
    ) as file:
        file.write(np.zeros((1, 9, 7), np.uint8))
    (found,) = open_maps(folder / "m.tif")
    assert first_pixel(found)[1] == pytest.approx(9, abs=1e-4)
    (local,) = open_maps(folder / "m.tif", crs="local", origin=[50, 8])
    assert local.georeference.plane.origin == (50, 8)
    (bounded,) = open_maps(folder / "m.tif", bounds=[60.404, 22.46, 60.402, 22.464])
    assert first_pixel(bounded)[0] == pytest.approx(60.404 - 0.002 / 18)


def test_tiff_without_rasterio(folder, monkeypatch):
    real = builtins.__import__

    def without(name, *rest):
        if name.startswith("rasterio"):
            raise ImportError(name)
        return real(name, *rest)

    Image.fromarray(np.zeros((20, 40, 3), np.uint8)).save(folder / "m.tif")
    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(UserError, match=r"m\.tif: a GeoTIFF needs rasterio: pip install 'diffnav\[geo\]'"):
        open_maps(folder / "m.tif")
    (folder / "m.tfw").write_text(DEGREES)
    assert first_pixel(open_maps(folder / "m.tif")[0]) == [60.4, 22.46]


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"bounds": [60.404, 22.46, 60.402]}, r"maps\.bounds must be \[north,west,south,east\]"),
        ({"bounds": ["a", 1, 2, 3]}, r"maps\.bounds must be"),
        (
            {"bounds": [60.402, 22.46, 60.404, 22.464]},
            r"maps\.bounds of .*a\.png: north 60\.402 lies below south 60\.404",
        ),
        ({"corners": CORNERS[:3]}, r"maps\.corners must be four pairs"),
        ({"corners": [1, 2, 3, 4]}, r"maps\.corners must be four pairs"),
        ({"corners": [CORNERS[0], CORNERS[1], CORNERS[3], CORNERS[2]]}, r"maps\.corners of .*a\.png: its sides cross"),
        ({"corners": CORNERS, "bounds": [1, 0, 0, 1]}, "both place the map; give one of them"),
        ({"bounds": [60.404, 22.46, 60.402, 22.464], "crs": "EPSG:25832"}, "EPSG:4326 or EPSG:3857"),
        ({"crs": "local"}, r"needs maps\.origin"),
        ({"crs": "local", "origin": 5}, r"maps\.origin must be"),
        ({}, "nothing says where it lies"),
    ],
)
def test_mistakes_are_one_sentence(folder, settings, reason):
    with pytest.raises(UserError, match=reason) as caught:
        open_maps(folder / "a.png", **settings)
    assert "\n" not in str(caught.value)


def test_what_is_no_map(folder):
    (folder / "text.jpg").write_text("no picture")
    (folder / "map.pdf").write_text("no picture")
    (folder / "empty").mkdir()
    for name, reason in (
        ("gone", "no map .*gone: give an image, a folder"),
        ("map.pdf", r"map\.pdf: no map; maps are files of the kinds"),
        ("empty", "no images in"),
    ):
        with pytest.raises(UserError, match=reason):
            open_maps(folder / name)
    with pytest.raises(ImageError, match=r"text\.jpg: not an image"):
        open_maps(folder / "text.jpg")
    with pytest.raises(UserError, match=r"maps\.corners and maps\.bounds place one image"):
        open_maps(folder, bounds=[1, 0, 0, 1])
