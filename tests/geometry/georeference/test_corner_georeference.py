"""Corners and bounds: linear between them (D21), and what is refused."""

import numpy as np
import pytest

from diffnav.geometry.georeference import WebMercator, bounds_georeference, corners_georeference

# The four corners that the author of the Fongyuan map gives: no exact rectangle.
FONGYUAN = [(24.2630274, 120.7157564), (24.2630537, 120.7223255), (24.2573723, 120.7223298), (24.2573680, 120.7158070)]
SIZE = (1947, 2052)


def slow_bilinear(size, corners, x, y):
    """D21 written out: weights are areas of the opposite rectangles; the corners are outer edges of outer pixels."""
    u, v = (x + 0.5) / size[1], (y + 0.5) / size[0]
    weights = ((1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v)
    return [sum(weight * corner[axis] for weight, corner in zip(weights, corners, strict=True)) for axis in (0, 1)]


def test_equals_the_bilinear_formula():
    georeference = corners_georeference(SIZE, FONGYUAN)
    for x, y in ((-0.5, -0.5), (2051.5, -0.5), (2051.5, 1946.5), (-0.5, 1946.5), (300.25, 1200.75), (0, 0)):
        np.testing.assert_allclose(georeference.latlon([x, y]), slow_bilinear(SIZE, FONGYUAN, x, y), atol=1e-12)


def test_the_corners_are_the_outer_edge():
    georeference = corners_georeference(SIZE, FONGYUAN)
    expected = [[-0.5, -0.5], [2051.5, -0.5], [2051.5, 1946.5], [-0.5, 1946.5]]
    np.testing.assert_allclose(georeference.pixels(FONGYUAN), expected, atol=1e-6)


@pytest.mark.parametrize("plane", [None, WebMercator()])
@pytest.mark.parametrize(
    "corners",
    [
        FONGYUAN,
        [(60.40, 179.97), (60.41, -179.91), (60.28, -179.88), (60.30, 179.93)],
        # North-west to the right, and strongly trapezoid.
        [(-10.5, 29.9), (-10.05, 29.7), (-10.0, 29.8), (-10.2, 30.0)],
        [(10.02, 20.0), (10.00, 20.3), (9.9, 20.2), (9.9, 20.12)],
    ],
)
def test_round_trip_of_large_maps(corners, plane):
    georeference = corners_georeference((100_000, 100_000), corners, plane)
    points = np.random.default_rng(2).uniform(-0.5, 99_999.5, (5000, 2))
    assert np.abs(georeference.pixels(georeference.latlon(points)) - points).max() < 1e-6


def test_bounds_by_hand():
    """wildnav's first tile: 1083 rows over .001553 degrees, 1249 columns over .003618."""
    georeference = bounds_georeference((1083, 1249), 60.403962, 22.460441, 60.402409, 22.464059)
    latitude = 60.403962 - 100.5 / 1083 * (60.403962 - 60.402409)
    longitude = 22.460441 + 200.5 / 1249 * (22.464059 - 22.460441)
    np.testing.assert_allclose(georeference.latlon([200, 100]), [latitude, longitude], atol=1e-12)
    np.testing.assert_allclose(georeference.pixels([latitude, longitude]), [200, 100], atol=1e-6)


def test_web_mercator_differs_in_the_middle_alone():
    """Between 0 and 60 N the middle row of a web map lies at 35.2 N: atan(sinh(asinh(tan 60) / 2))."""
    even = bounds_georeference((1001, 1001), 60, 0, 0, 60, WebMercator())
    assert even.latlon([500, 500])[0] == pytest.approx(np.degrees(np.arctan(np.sinh(np.arcsinh(np.sqrt(3)) / 2))))
    assert bounds_georeference((1001, 1001), 60, 0, 0, 60).latlon([500, 500])[0] == pytest.approx(30)
    np.testing.assert_allclose(even.latlon([[-0.5, -0.5], [1000.5, 1000.5]]), [[60, 0], [0, 60]], atol=1e-12)


def test_bounds_over_the_antimeridian_and_around_the_earth():
    for west, east in ((179.5, -179.5), (179.5, 180.5), (-180.5, -179.5)):
        georeference = bounds_georeference((10, 10), 1, west, 0, east)
        np.testing.assert_allclose(georeference.latlon([[4.5, 0], [9.5, 0]])[:, 1], [-180, -179.5])
        np.testing.assert_allclose(georeference.pixels([[1, -179.6]]), [[8.5, -0.5]], atol=1e-9)
    world = bounds_georeference((160, 360), 80, -180, -80, 180)
    np.testing.assert_allclose(world.pixels([[79.5, -179.5], [79.5, 179.5]]), [[0, 0], [359, 0]], atol=1e-9)


@pytest.mark.parametrize(
    ("bounds", "reason"),
    [
        ((60.402, 22.460, 60.404, 22.464), r"north 60\.402 lies below south 60\.404: exchange them"),
        ((60.404, 22.464, 60.402, 22.460), r"west 22\.464 lies beyond east 22\.46: exchange them"),
        ((60.402, 22.464, 60.404, 22.460), "north .* below south .* and west .* beyond east .*: exchange them"),
        # Longitude first: north and west, south and east exchanged.
        ((22.460, 60.404, 22.464, 60.402), "lies below south"),
        ((60.404, 22.46, 60.404, 22.47), "one line"),
        ((120.7, 24.26, 120.6, 24.27), "latitude 120.7 .* beyond 90"),
        ((90, -180, -90, 180), "within 1 degree of a pole"),
        ((89.5, 10, 89.4, 11), "within 1 degree of a pole"),
    ],
)
def test_bounds_that_cannot_be(bounds, reason):
    with pytest.raises(ValueError, match=reason):
        bounds_georeference((100, 100), *bounds)


TL, TR, BR, BL = (60.404, 22.460), (60.404, 22.464), (60.402, 22.464), (60.402, 22.460)


@pytest.mark.parametrize(
    ("corners", "reason"),
    [
        ((TL, TR, BL, BR), "sides cross: the corners' order is top left, top right, bottom right, bottom left"),
        ((TL, BR, TR, BL), "sides cross"),
        ((TR, TL, BL, BR), "anticlockwise, so that it would be mirrored"),
        ((BL, BR, TR, TL), "anticlockwise"),
        ((BR, TR, TL, BL), "anticlockwise"),
        # Latitudes and longitudes exchanged.
        (tuple(corner[::-1] for corner in (TL, TR, BR, BL)), "anticlockwise, .* each latitude, longitude"),
        ((TL, TL, BR, BL), "one point"),
        ((TL, TR, (60.403, 22.462), BL), "one line"),
        # Not convex: the bottom right corner lies inside the triangle of the others.
        ((TL, TR, (60.4035, 22.4605), BL), "sides cross"),
        ((TL, TR, BR), "four pairs"),
        ((TL, TR, BR, (60.4, float("nan"))), "bottom left corner has no finite"),
    ],
)
def test_corners_that_cannot_be(corners, reason):
    with pytest.raises(ValueError, match=reason):
        corners_georeference((100, 100), corners)


@pytest.mark.parametrize("turns", range(4))
def test_any_heading_is_a_map(turns):
    corners = [TL, TR, BR, BL]
    georeference = corners_georeference((100, 200), corners[turns:] + corners[:turns])
    np.testing.assert_allclose(georeference.pixels([corners[turns]]), [[-0.5, -0.5]], atol=1e-6)


def test_far_places_are_not_inside():
    """A bilinear law bends back on itself outside: there pixels are not finite, or outside."""
    georeference = corners_georeference((100, 100), [(10.02, 20.0), (10.00, 20.3), (9.9, 20.2), (9.9, 20.12)])
    grid = np.stack(np.meshgrid(np.linspace(-80, 80, 81), np.linspace(-180, 180, 91), indexing="ij"), -1)
    found = georeference.pixels(grid)
    with np.errstate(invalid="ignore"):
        inside = ((found > -0.5) & (found < 99.5)).all(-1)
    assert not inside.any()
