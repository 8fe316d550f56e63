"""World files: six lines, centres of pixels, and in which system they count."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from diffnav.data.maps.coordinate_system import CoordinateSystem
from diffnav.data.maps.world_files import read_world_file, world_file_map, world_file_of
from diffnav.errors import UserError

DEGREES = "0.0001\n0\n0\n-0.0002\n22.46\n60.4\n"
UTM = "0.5\n0.0\n0.0\n-0.5\n500000.0\n5000000.0\n"
WKT = (
    'PROJCS["WGS 84 / UTM zone 33N",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],'
    'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],'
    'PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",15],PARAMETER["scale_factor",0.9996],'
    'PARAMETER["false_easting",500000],PARAMETER["false_northing",0],UNIT["metre",1]]'
)


def picture(folder: Path, name: str, world: str, prj: str | None = None) -> Path:
    Image.fromarray(np.zeros((30, 50, 3), np.uint8)).save(folder / name)
    stem, kind = name.rsplit(".", 1)
    (folder / f"{stem}.{kind[0]}{kind[-1]}w").write_text(world)
    if prj:
        (folder / f"{stem}.prj").write_text(prj)
    return folder / name


def open_map(path: Path, **system):
    return world_file_map(path, path.stem, CoordinateSystem(**system))


def test_numbers_are_of_pixel_centres(tmp_path):
    found = open_map(picture(tmp_path, "a.jpg", DEGREES))
    assert found.size == (30, 50)
    np.testing.assert_allclose(
        found.georeference.latlon([[0, 0], [10, 20]]), [[60.4, 22.46], [60.396, 22.461]], atol=1e-12
    )


def test_order_of_the_lines(tmp_path):
    """A, D, B, E, C, F: D is the change of y along a row, B of x along a column; padded as GIS programs do."""
    (tmp_path / "a.tfw").write_text("   1.5 \r\n  0.25\r\n -0.5 \r\n -2.0\r\n 100.0 \r\n  200.00 \r\n\r\n")
    assert read_world_file(tmp_path / "a.tfw") == (1.5, -0.5, 100, 0.25, -2, 200)


@pytest.mark.parametrize(
    ("name", "world"),
    [
        ("a.jpg", "a.jgw"), ("a.jpeg", "a.jgw"), ("a.jpg", "a.jpgw"), ("a.png", "a.pgw"), ("a.PNG", "a.PGW"),
        ("a.tif", "a.tfw"), ("a.tiff", "a.tiffw"), ("a.b.png", "a.b.pgw"), ("a.bmp", "a.wld"), ("a.jpg", "a.WLD"),
    ],
)  # fmt: skip
def test_endings(tmp_path, name, world):
    assert world_file_of(tmp_path / name) is None
    (tmp_path / world).write_text(DEGREES)
    assert world_file_of(tmp_path / name) == tmp_path / world


def test_without_a_world_file(tmp_path):
    Image.fromarray(np.zeros((3, 5, 3), np.uint8)).save(tmp_path / "a.png")
    assert open_map(tmp_path / "a.png") is None


def test_system_of_the_prj_beside_it(tmp_path):
    pytest.importorskip("pyproj")
    found = open_map(picture(tmp_path, "a.png", UTM, WKT))
    # On the central meridian, 15 E.
    assert found.georeference.latlon([0, 0])[1] == pytest.approx(15, abs=1e-9)
    # The user's word goes first.
    assert open_map(tmp_path / "a.png", crs="EPSG:32632").georeference.latlon([0, 0])[1] == pytest.approx(9, abs=1e-9)


def test_local_metres(tmp_path):
    path = picture(tmp_path, "a.png", "0.5\n0\n0\n-0.5\n0\n0\n")
    found = open_map(path, crs="local", origin=(60.0, 22.0))
    assert found.georeference.latlon([0, 20])[0] == pytest.approx(60 - 10 / 111_195.0802)


def test_metres_without_a_system(tmp_path):
    for name, world in (("a.png", UTM), ("b.png", "0.5\n0\n0\n-0.5\n-12\n9\n")):
        with pytest.raises(UserError, match=rf"{name[0]}\.pgw: its numbers .* no \.prj file .*; set maps\.crs"):
            open_map(picture(tmp_path, name, world))


@pytest.mark.parametrize(
    ("world", "reason"),
    [
        ("0.0001\n0\n0\n-0.0002\n22.46\n", r"a\.pgw: a world file is six lines"),
        ("0.0001\n0\n0\n-0.0002\n22.46\nnorth\n", r"a\.pgw: a world file is six lines"),
        ("0.0001\n0\n0\n-0.0002\n22.46\ninf\n", r"a\.pgw: a world file is six lines"),
    ],
)
def test_damaged_files(tmp_path, world, reason):
    with pytest.raises(UserError, match=reason):
        open_map(picture(tmp_path, "a.png", world))


def test_wrong_numbers_name_the_picture(tmp_path):
    path = picture(tmp_path, "a.png", DEGREES.replace("-0.0002", "0.0002"))
    with pytest.raises(UserError, match=r"a\.png: it is mirrored.* y size .* is negative"):
        open_map(path, crs="EPSG:4326")
    with pytest.raises(UserError, match=r"a\.png: its bounds, .* are no degrees; set maps\.crs=local maps\.origin"):
        open_map(picture(tmp_path, "a.png", UTM), crs="EPSG:4326")
    with pytest.raises(UserError, match=r"maps\.crs=EPSG:99999: .*EPSG:99999 cannot be used"):
        open_map(path, crs="EPSG:99999")
    with pytest.raises(UserError, match=r"a\.png: its coordinate system nonsense cannot be used"):
        open_map(picture(tmp_path, "a.png", UTM, "nonsense"))


def test_settings_that_do_not_go_together():
    for system, reason in (
        ({"crs": "local"}, r"maps\.crs=local needs maps\.origin"),
        ({"origin": (1.0, 2.0)}, r"set maps\.crs=local"),
        ({"crs": "EPSG:32632", "origin": (1.0, 2.0)}, r"set maps\.crs=local"),
        ({"crs": "local", "origin": (91.0, 2.0)}, r"maps\.origin must be"),
    ):
        with pytest.raises(UserError, match=reason):
            CoordinateSystem(**system)
