"""Six numbers: by hand, back and forth, over the antimeridian."""

import pickle

import numpy as np
import pytest
import torch

from diffnav.geometry.georeference import (
    AffineGeoreference,
    Degrees,
    ImpossibleBoundsError,
    LocalMetres,
    WebMercator,
    from_outer_corner,
    plane_of,
)

LARGE = (100_000, 100_000)


def round_trip_error_px(georeference):
    height, width = georeference.size
    points = np.random.default_rng(1).uniform((-0.3 * width, -0.3 * height), (1.3 * width, 1.3 * height), (2000, 2))
    return np.abs(georeference.pixels(georeference.latlon(points)) - points).max()


def test_by_hand():
    """The second pixel to the right is 2 x 0.125 degrees east of the first one's centre."""
    georeference = AffineGeoreference((40, 60), Degrees(), (0.125, 0, 10.0, 0, -0.25, 50.0))
    np.testing.assert_array_equal(georeference.latlon([[0, 0], [2, 0], [0, 2], [59, 39]]), [
        [50, 10], [50, 10.25], [49.5, 10], [40.25, 17.375],
    ])  # fmt: skip
    np.testing.assert_array_equal(georeference.pixels([[49.5, 10.25 + 720]]), [[2, 2]])


def test_turned():
    """A map whose rows run north-east: x' = 3 x + 4 y, y' = 4 x - 3 y metres, five metres a pixel."""
    georeference = AffineGeoreference((40, 60), LocalMetres((0.0, 0.0)), (3, 4, 0, 4, -3, 0))
    degree_m = 111_195.0802
    np.testing.assert_allclose(georeference.latlon([10, 0]) * degree_m, [40, 30], atol=1e-4)
    np.testing.assert_allclose(georeference.latlon([0, 10]) * degree_m, [-30, 40], atol=1e-4)
    assert round_trip_error_px(georeference) < 1e-6


@pytest.mark.parametrize(
    ("crs", "transform"),
    [
        (None, (1e-6, 2e-8, 120.7, 3e-8, -1e-6, 24.2)),
        ("EPSG:3857", (0.15, 0, 1.3e7, 0, -0.15, 2.8e6)),
        ("local", (0.1, 0.02, -5000, 0.02, -0.1, 3000)),
        ("EPSG:26914", (0.1, 0.01, 486_900, 0.01, -0.1, 5_208_747)),
        ("EPSG:27700", (0.1, 0, 400_000, 0, -0.1, 300_000)),
        ("EPSG:2193", (0.2, 0, 1_874_501, 0, -0.2, 5_827_361)),
    ],
)
def test_round_trip_far_from_the_origin(crs, transform):
    if crs in ("EPSG:26914", "EPSG:27700", "EPSG:2193"):
        pytest.importorskip("pyproj")
    plane = plane_of(crs, (transform[2], transform[5]), (60.4, 22.4) if crs == "local" else None)
    assert round_trip_error_px(AffineGeoreference(LARGE, plane, transform)) < 1e-6


@pytest.mark.parametrize("plane", [Degrees(), WebMercator()])
@pytest.mark.parametrize("turn", [-1, 0])
def test_over_the_antimeridian(plane, turn):
    start, end = plane.xy(np.array([[52.0, 179.9 + 360 * turn], [51.9, 180.1 + 360 * turn]]))
    step = (end - start) / 1000
    georeference = AffineGeoreference((1001, 1001), plane, (step[0], 0, start[0], 0, step[1], start[1]))
    found = georeference.latlon([[0, 0], [500, 0], [1000, 1000]])
    np.testing.assert_allclose(found[:, 1], [179.9, -180, -179.9], atol=1e-9)
    np.testing.assert_allclose(georeference.pixels([[52, -179.9], [52, 180.1]]), [[1000, 0], [1000, 0]], atol=1e-6)
    assert round_trip_error_px(georeference) < 1e-6


def test_over_the_antimeridian_in_another_datum():
    pytest.importorskip("pyproj")
    plane = plane_of("EPSG:4269", (179.99, 52.0))
    georeference = AffineGeoreference((2000, 2000), plane, (1e-5, 0, 179.99, 0, -1e-5, 52))
    np.testing.assert_allclose(georeference.latlon([1999, 0])[1], -179.99001, atol=1e-4)
    assert round_trip_error_px(georeference) < 1e-6


def test_of_the_whole_earth_but_its_poles():
    georeference = AffineGeoreference((176, 360), Degrees(), (1, 0, -179.5, 0, -1, 87.5))
    np.testing.assert_allclose(georeference.latlon([[0, 0], [359, 175]]), [[87.5, -179.5], [-87.5, 179.5]])
    np.testing.assert_allclose(georeference.pixels([[87.5, 180.5]]), [[0, 0]])
    # Beyond the edge latitudes stop at the pole.
    assert georeference.latlon([0, -20])[0] == 90


def test_outer_corner_of_gdal():
    """A GeoTIFF's c, f are half a pixel up and left of the first pixel's centre."""
    assert from_outer_corner((0.5, 0, 100, 0, -0.5, 200)) == (0.5, 0, 100.25, 0, -0.5, 199.75)
    assert from_outer_corner((3, 4, 0, 4, -3, 0)) == (3, 4, 3.5, 4, -3, 0.5)


def test_tensors_and_copies():
    georeference = AffineGeoreference((40, 60), WebMercator(), (1, 0, 1e6, 0, -1, 6e6))
    points = torch.tensor([[1.0, 2.0], [30.5, 3.25]])
    copy = pickle.loads(pickle.dumps(georeference))
    np.testing.assert_array_equal(copy.latlon(points), georeference.latlon(points.numpy()))
    assert copy == georeference
    assert georeference.latlon(points).dtype == np.float64


def test_numbers_that_make_no_map():
    for transform, reason in (
        ((1, 0, 0, 0, 0, 0), "no area"),
        ((1, 2, 0, 2, 4, 0), "no area"),
        ((float("nan"), 0, 0, 0, -1, 0), "six finite"),
    ):
        with pytest.raises(ValueError, match=reason):
            AffineGeoreference((10, 10), Degrees(), transform)
    with pytest.raises(ImpossibleBoundsError, match=r"latitude -93\.0000 to 93\.0000 .* are no degrees"):
        AffineGeoreference((1024, 1024), Degrees(), from_outer_corner((0.181640625, 0, -93, 0, -0.181640625, 93)))
