"""Planes: degrees, Web-Mercator, local metres, and any coordinate reference system."""

import builtins

import numpy as np
import pytest

from diffnav.errors import UserError
from diffnav.geometry.geodesy import haversine_m
from diffnav.geometry.georeference import Degrees, LocalMetres, Projected, WebMercator, plane_of
from diffnav.geometry.georeference.projected import _operation

PLACES = np.array([[60.4, 22.46], [-36.85, 174.76], [0, 0], [47.0, -99.1]])


def test_degrees_put_longitude_first():
    np.testing.assert_array_equal(Degrees().xy(PLACES)[0], [22.46, 60.4])
    np.testing.assert_array_equal(Degrees().latlon(Degrees().xy(PLACES)), PLACES)


def test_web_mercator():
    """Numbers of EPSG:3857 as published: the half circumference, and 45 degrees north."""
    half = 20_037_508.342789244
    np.testing.assert_allclose(WebMercator().xy(np.array([0, 180])), [half, 0], atol=1e-7)
    np.testing.assert_allclose(WebMercator().xy(np.array([45, 90])), [half / 2, 5_621_521.486192066], rtol=1e-14)
    # The square map of the web ends where it is as high as it is wide.
    np.testing.assert_allclose(WebMercator().latlon(np.array([half, half])), [85.0511287798066, 180], rtol=1e-14)
    np.testing.assert_allclose(WebMercator().latlon(WebMercator().xy(PLACES)), PLACES, atol=1e-12)
    # Beyond the antimeridian it goes on.
    np.testing.assert_allclose(WebMercator().latlon(WebMercator().xy(np.array([10, 185]))), [10, 185], atol=1e-12)


def test_web_mercator_agrees_with_pyproj():
    pyproj = pytest.importorskip("pyproj")
    expected = pyproj.Transformer.from_crs(4326, 3857, always_xy=True).transform(PLACES[:, 1], PLACES[:, 0])
    np.testing.assert_allclose(WebMercator().xy(PLACES), np.stack(expected, -1), atol=1e-6)


def test_local_metres():
    plane = LocalMetres((60.0, 22.0))
    assert plane.xy(np.array([60.001, 22.0])) == pytest.approx([0, 111.19508], abs=1e-5)
    assert plane.xy(np.array([60.0, 22.002])) == pytest.approx([111.195, 0], abs=0.01)
    assert haversine_m((60, 22), plane.latlon(np.array([3000.0, 4000.0]))) == pytest.approx(5000)
    with pytest.raises(ValueError, match="from -90 to 90"):
        LocalMetres((91.0, 0.0))


def test_names_of_planes():
    for crs in (None, "EPSG:4326", "epsg:4326", "OGC:CRS84"):
        assert plane_of(crs) == Degrees()
    assert plane_of(" epsg:3857 ") == WebMercator()
    assert plane_of("Local", origin=(1.0, 2.0)) == LocalMetres((1.0, 2.0))
    with pytest.raises(ValueError, match="origin"):
        plane_of("local")


def test_utm_by_its_definition():
    """On the central meridian of zone 32 (9 E): 500 km east, and 0.9996 of the meridian's arc to 45 N."""
    pytest.importorskip("pyproj")
    plane = plane_of("EPSG:32632", (500_000.0, 4_900_000.0))
    np.testing.assert_allclose(
        plane.xy(np.array([[0.0, 9.0], [45.0, 9.0]])), [[500e3, 0], [500e3, 4_982_950.4002]], atol=1e-3
    )
    np.testing.assert_allclose(plane.latlon(np.array([500e3, 0.0])), [0, 9], atol=1e-12)


@pytest.mark.parametrize(
    ("crs", "x", "y"),
    [
        ("EPSG:2193", 1.87e6, 5.8e6),  # its axes are north, east
        ("EPSG:27700", 4e5, 3e5),  # a datum shift that PROJ undoes to a millimetre
        ("EPSG:3035", 4.3e6, 3.2e6),  # several operations to choose from
        ("EPSG:2056", 2.6e6, 1.2e6),
        ("EPSG:26914", 486_900.0, 5_208_747.0),
        ("EPSG:4269", -99.0, 47.0),  # degrees of another datum
    ],
)
def test_back_and_forth_to_rounding(crs, x, y):
    pyproj = pytest.importorskip("pyproj")
    plane = Projected(crs, (x, y))
    steps = np.random.default_rng(0).uniform(-2e-3, 2e-3, (50, 2))
    xy = np.array([x, y]) * (1 + steps)
    found = plane.latlon(xy)
    np.testing.assert_allclose(plane.xy(found), xy, rtol=0, atol=1e-8)
    # The general transformation, which may take another datum shift: a few metres.
    longitude, latitude = pyproj.Transformer.from_crs(crs, 4326, always_xy=True).transform(xy[:, 0], xy[:, 1])
    assert haversine_m(found, np.stack([latitude, longitude], -1)).max() < 5


def test_what_cannot_be_used():
    pytest.importorskip("pyproj")
    for crs, reason in (
        ("EPSG:99999", "crs not found|EPSG:99999"),
        ("nonsense", "nonsense"),
        ('LOCAL_CS["somewhere in a field without a place on the earth",UNIT["metre",1]]', "somewhere in a field"),
    ):
        with pytest.raises(ValueError, match=reason):
            plane_of(crs)


def test_without_pyproj_one_sentence(monkeypatch):
    real = builtins.__import__

    def without(name, *rest):
        if name.startswith("pyproj"):
            raise ImportError(name)
        return real(name, *rest)

    _operation.cache_clear()
    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(UserError, match=r"a map in EPSG:25832 needs pyproj: pip install 'diffnav\[geo\]'"):
        plane_of("EPSG:25832")
    assert plane_of("EPSG:3857") == WebMercator()
    monkeypatch.undo()
    _operation.cache_clear()
