"""The real maps and photos, where they lie beside the repository: their README's facts."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from diffnav.data.maps.opening import open_maps
from diffnav.data.queries.folder import folder_queries
from diffnav.errors import UserError
from diffnav.geometry.geodesy import haversine_m
from diffnav.geometry.georeference import ground_sample_distance_m, metres_per_pixel

NAV = Path("../shared/data/nav")
pytestmark = pytest.mark.skipif(not NAV.is_dir(), reason="needs the navigation data beside the repository")


def extent_m(found) -> tuple[float, float]:
    height, width = found.size
    scale = metres_per_pixel(found.georeference, [(width - 1) / 2, (height - 1) / 2])
    return np.linalg.norm(scale[:, 0]) * width, np.linalg.norm(scale[:, 1]) * height


def inside(found, place) -> bool:
    height, width = found.size
    x, y = found.georeference.pixels(place)
    return -0.5 < x < width - 0.5 and -0.5 < y < height - 0.5


def test_wildnav():
    maps = open_maps(NAV / "wildnav" / "map")
    queries, problems = folder_queries(NAV / "wildnav" / "query")
    assert len(maps) == 15
    assert problems == []
    assert all(extent_m(found) == pytest.approx((198.7, 172.7), abs=0.3) for found in maps)
    assert all(any(inside(found, query.truth) for found in maps) for query in queries)
    assert [round(query.height_m) for query in queries] == [120, 120]


def test_fongyuan():
    (found,) = open_maps(NAV / "fongyuan" / "map")
    assert extent_m(found) == pytest.approx((665.9, 629.3), abs=0.1)
    queries, problems = folder_queries(NAV / "fongyuan" / "query")
    assert (len(queries), problems) == (42, [])
    assert all(inside(found, query.truth) for query in queries)
    # Measured on the map: .141 to .149 m/px; heading within 6 degrees of the logged one.
    assert all(0.125 < query.ground_sample_distance_m < 0.175 for query in queries)
    # The log's own columns 17, 18 and the photos' EXIF say the same places.
    log, _ = folder_queries(
        NAV / "fongyuan" / "query",
        NAV / "fongyuan" / "FongYuanLog2_utf8.csv",
        {"name": 1, "latitude": 17, "longitude": 18},
    )
    assert haversine_m([query.truth for query in log], [query.truth for query in queries]).max() < 0.1


def test_aerovloc():
    maps = open_maps(NAV / "aerovloc_mini" / "map")
    assert [found.size for found in maps] == [(1230, 1280)] * 2
    assert ground_sample_distance_m(maps[0].georeference) == pytest.approx(0.338, abs=0.001)
    queries, _ = folder_queries(NAV / "aerovloc_mini" / "queries")
    assert [[inside(found, query.truth) for found in maps] for query in queries] == [[True, False], [False, False]]


def test_exif_of_caliterra():
    queries, problems = folder_queries(NAV / "odm_caliterra" / "images")
    places = np.array([query.truth for query in queries])
    assert (len(queries), problems) == (42, [])
    np.testing.assert_allclose(places.min(0), [30.1706, -98.0900], atol=1e-4)
    np.testing.assert_allclose(places.max(0), [30.1715, -98.0892], atol=1e-4)
    assert all(before.time < after.time for before, after in itertools.pairwise(queries))


def test_geotiffs():
    pytest.importorskip("rasterio")
    pytest.importorskip("pyproj")
    first, second = (open_maps(NAV / "geotiff" / f"naip_nd_{year}_crop.tif")[0] for year in (2009, 2015))
    # One place, origins 2 m apart in northing.
    apart = haversine_m(first.georeference.latlon([280, 280]), second.georeference.latlon([280, 280]))
    assert apart == pytest.approx(2, abs=0.02)
    (mercator,) = open_maps(NAV / "geotiff" / "mercator.tif")
    latitude = mercator.georeference.latlon([0, 0])[0]
    assert ground_sample_distance_m(mercator.georeference, [0, 0]) == pytest.approx(
        10 * np.cos(np.radians(latitude)), rel=0.002
    )
    for name, reason in (
        ("rotated.tif", "states no coordinate system"),
        ("world.rgb.tif", "within 1 degree of a pole"),
    ):
        with pytest.raises(UserError, match=reason):
            open_maps(NAV / "geotiff" / name)


def test_world_files():
    pytest.importorskip("rasterio")
    pytest.importorskip("pyproj")
    maps = {found.name: found for found in open_maps(NAV / "worldfile")}
    for name, metres in (("Pk50095", 21.17), ("test_raster_NZTM", 2.0)):
        assert ground_sample_distance_m(maps[name].georeference) == pytest.approx(metres, rel=0.005)
    # The pgw's C, F are the first pixel's centre.
    np.testing.assert_allclose(
        maps["global_mosaic_0"].georeference.latlon([0, 0]), [38.491372862272705, 6.375141924963005], atol=1e-9
    )
    assert all(found.picture().shape[1:] == found.size for found in maps.values())


def test_ortholoc():
    pytest.importorskip("rasterio")
    path = NAV / "ortholoc_demo" / "urban_residential_DOP.tif"
    with pytest.raises(UserError, match=r"are no degrees; set maps\.crs=local maps\.origin"):
        open_maps(path)
    (found,) = open_maps(path, crs="local", origin=[48.0, 11.0])
    assert ground_sample_distance_m(found.georeference) == pytest.approx(0.1815, abs=1e-4)
