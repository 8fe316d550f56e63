"""GeoTIFF maps: half a pixel, coordinate systems, rotated transforms, and the traps of their tags."""

import numpy as np
import pytest
import torch
from PIL import Image

from diffnav.data.maps.coordinate_system import CoordinateSystem
from diffnav.data.maps.geotiff import geotiff_map
from diffnav.errors import UserError
from diffnav.images import ImageError

rasterio = pytest.importorskip("rasterio")
warp = pytest.importorskip("rasterio.warp")
pytest.importorskip("pyproj")

LEVELS = np.random.default_rng(4).integers(0, 256, (3, 20, 40), dtype=np.uint8)
# ESRI's own WKT, without numbers of authorities.
NAMELESS = rasterio.crs.CRS.from_proj4("+proj=utm +zone=32 +datum=WGS84 +units=m")


def write(path, transform, crs=None, levels=LEVELS):
    count, height, width = levels.shape
    shape = {"count": count, "height": height, "width": width, "dtype": levels.dtype.name}
    with rasterio.open(path, "w", driver="GTiff", crs=crs, transform=rasterio.Affine(*transform), **shape) as file:
        file.write(levels)
    return path


def open_map(path, **system):
    return geotiff_map(path, path.stem, CoordinateSystem(**system))


def test_half_a_pixel(tmp_path):
    """Its transform is of the outer corner: the first pixel's centre lies 2.5 m east and south of it."""
    found = open_map(write(tmp_path / "a.tif", (5, 0, 500_000, 0, -5, 5_000_000), "EPSG:32632"))
    assert found.size == (20, 40)
    projected = warp.transform("EPSG:4326", "EPSG:32632", *found.georeference.latlon([[0, 0], [3, 2]]).T[::-1])
    np.testing.assert_allclose(np.transpose(projected), [[500_002.5, 4_999_997.5], [500_017.5, 4_999_987.5]], atol=1e-6)
    expected = torch.from_numpy(LEVELS[:, 4:10, 30:40]) / 255
    torch.testing.assert_close(found.read((4, 30, 6, 10)), expected, rtol=0, atol=1e-7)


@pytest.mark.parametrize("crs", ["EPSG:3857", "EPSG:26914", "EPSG:2193", NAMELESS])
def test_places_agree_with_gdal(tmp_path, crs):
    starts = {"EPSG:3857": (1.3e6, 6.4e6), "EPSG:26914": (486_900, 5.2e6), "EPSG:2193": (1.87e6, 5.8e6)}
    x, y = starts.get(crs, (5e5, 5e6)) if isinstance(crs, str) else (5e5, 5e6)
    path = write(tmp_path / "a.tif", (10, 1, x, 2, -10, y), crs)
    with rasterio.open(path) as source:
        corners = [source.xy(row, column) for row, column in ((0, 0), (19, 39), (7, 3))]
        longitudes, latitudes = warp.transform(source.crs, "EPSG:4326", *np.transpose(corners))
    points = [[0, 0], [39, 19], [3, 7]]
    found = open_map(path)
    np.testing.assert_allclose(found.georeference.latlon(points), np.transpose([latitudes, longitudes]), atol=1e-9)
    np.testing.assert_allclose(found.georeference.pixels(found.georeference.latlon(points)), points, atol=1e-6)


def test_local_metres_that_claim_to_be_degrees(tmp_path):
    """As ortholoc's: EPSG:4326, x and y from -93 to 93."""
    path = write(tmp_path / "a.tif", (4.65, 0, -93, 0, -9.3, 93), "EPSG:4326")
    with pytest.raises(UserError, match=r"a\.tif: its bounds, .*set maps\.crs=local maps\.origin=\[lat,lon\] .*EPSG:"):
        open_map(path)
    found = open_map(path, crs="local", origin=(48.0, 11.0))
    assert found.georeference.latlon([19.5, -0.5])[0] == pytest.approx(48 + 93 / 111_195.0802, abs=1e-9)
    np.testing.assert_allclose(found.georeference.latlon([19.5, 9.5]), [48, 11], atol=1e-12)


def test_without_a_system(tmp_path):
    path = write(tmp_path / "a.tif", (17.3, 5, 100, 10, -8.6, 200))
    sentence = r"a\.tif: states no coordinate system on the earth; name it, .*maps\.crs=local"
    with pytest.raises(UserError, match=sentence):
        open_map(path)
    assert open_map(path, crs="EPSG:32618").size == (20, 40)
    (tmp_path / "a.prj").write_text(NAMELESS.to_wkt())
    assert open_map(path).georeference.latlon([0, 0])[1] == pytest.approx(4.5125, abs=1e-3)


def test_a_system_without_a_place_on_the_earth(tmp_path):
    """As etopo.tif has it: engineering coordinates; the file beside it knows better."""
    local = rasterio.crs.CRS.from_wkt('LOCAL_CS["unknown",UNIT["metre",1]]')
    path = write(tmp_path / "a.tif", (0.125, 0, 118, 0, -0.125, 47), local)
    with pytest.raises(UserError, match="states no coordinate system on the earth"):
        open_map(path)
    (tmp_path / "a.prj").write_text(rasterio.crs.CRS.from_epsg(4326).to_wkt())
    np.testing.assert_allclose(open_map(path).georeference.latlon([-0.5, -0.5]), [47, 118], atol=1e-9)


def test_world_file_beside_a_plain_tiff(tmp_path):
    path = tmp_path / "a.tif"
    Image.fromarray(LEVELS.transpose(1, 2, 0)).save(path)
    assert open_map(path) is None
    (tmp_path / "a.tfw").write_text("0.0001\n0\n0\n-0.0001\n22.46\n60.4\n")
    np.testing.assert_allclose(open_map(path).georeference.latlon([0, 0]), [60.4, 22.46], atol=1e-10)
    (tmp_path / "a.tfw").write_text("0.5\n0\n0\n-0.5\n22\n60\n")
    with pytest.raises(UserError, match="states no coordinate system"):
        open_map(path)


def test_unreadable(tmp_path):
    (tmp_path / "a.tif").write_bytes(b"II*\0 and nothing more")
    with pytest.raises(ImageError, match=r"a\.tif: damaged image"):
        open_map(tmp_path / "a.tif")
