"""Distances on the sphere, against Eq. 11 written out, the ellipsoid, and properties."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diffnav.geometry.geodesy import EARTH_RADIUS_M, bearing_deg, haversine_m, moved, offset_m, wrapped_deg

PLACES = st.tuples(st.floats(-90, 90), st.floats(-720, 720))
TOWNS = [(60.4047, 22.4659), (24.26, 120.72), (-36.85, 174.76), (46.95, -99.1), (0.0, 0.0), (89.5, 10.0)]


def eq_11(a, b):
    """The formula as printed in the paper, with the root's argument clamped."""
    (lat_e, lng_e), (lat_r, lng_r) = ([math.radians(value) for value in place] for place in (a, b))
    root = math.sin((lat_e - lat_r) / 2) ** 2
    root += math.cos(lat_e) * math.cos(lat_r) * math.sin((lng_e - lng_r) / 2) ** 2
    return 2 * EARTH_RADIUS_M * math.asin(math.sqrt(min(max(root, 0), 1)))


def test_known_distances():
    assert haversine_m((0, 0), (1, 0)) == pytest.approx(111_195.08, abs=0.005)
    assert haversine_m((60, 0), (60, 1)) == pytest.approx(55_597.01, abs=0.005)
    assert haversine_m((60, 0), (60, 1)) == pytest.approx(eq_11((60, 0), (60, 1)), rel=1e-12)
    assert haversine_m((12.5, 7), (12.5, 7)) == 0
    assert haversine_m((90, 0), (-90, 77)) == pytest.approx(math.pi * EARTH_RADIUS_M, rel=1e-15)


@given(PLACES, PLACES)
def test_equals_the_printed_formula(a, b):
    # The arcsine of the formula is good to 1e-8 rad near the antipode only: .2 m.
    assert haversine_m(a, b) == pytest.approx(eq_11(a, b), rel=1e-9, abs=0.3)
    assert haversine_m(a, b) == haversine_m(b, a)


def test_vectorised_and_broadcast():
    a, b = np.array(TOWNS), np.array(TOWNS[::-1])
    distances = haversine_m(a[:, None], b)
    assert distances.shape == (6, 6)
    assert distances[1, 3] == haversine_m(TOWNS[1], TOWNS[2])
    assert offset_m(TOWNS[0], b).shape == (6, 2)
    assert moved(a[:, None], np.zeros((1, 4, 2))).shape == (6, 4, 2)


@pytest.mark.parametrize("place", TOWNS)
def test_a_millimetre(place):
    """Beside the same distance by differences alone, which is exact where it is small."""
    latitude, longitude = place
    for north, east in ((1e-8, 0.0), (0.0, 1e-8), (1e-8, -2e-8)):
        # As stored: 1e-8 degrees are a few hundred units in the last place of a longitude.
        north, east = latitude + north - latitude, longitude + east - longitude
        expected = math.radians(math.hypot(north, east * math.cos(math.radians(latitude)))) * EARTH_RADIUS_M
        there = (latitude + north, longitude + east)
        assert haversine_m(place, there) == pytest.approx(expected, rel=1e-6)
        assert np.linalg.norm(offset_m(place, there)) == pytest.approx(expected, rel=1e-6)


def test_near_the_antipode_no_digits_are_lost():
    half = math.pi * EARTH_RADIUS_M
    for metres in (0.001, 1.0, 5_000.0):
        away = math.degrees(metres / EARTH_RADIUS_M)
        assert half - haversine_m((20, 30), (-20 + away, 210)) == pytest.approx(metres, abs=3e-8)
    assert haversine_m((20, 30), (-20, -150)) == pytest.approx(half, rel=1e-15)


@given(PLACES, PLACES, st.integers(-2, 2))
def test_turns_of_longitude_do_not_matter(a, b, turns):
    turned = (b[0], b[1] + 360 * turns)
    assert haversine_m(a, turned) == pytest.approx(haversine_m(a, b), abs=1e-5)


def test_within_six_per_mille_of_the_ellipsoid():
    geodesic = pytest.importorskip("geographiclib.geodesic").Geodesic.WGS84
    generator = np.random.default_rng(5)
    places = np.stack([generator.uniform(-90, 90, 400), generator.uniform(-180, 180, 400)], -1).reshape(200, 2, 2)
    near = places[:, :1] + generator.uniform(-0.01, 0.01, (200, 1, 2))
    pairs = np.concatenate([places, np.concatenate([places[:, :1], np.clip(near, [-90, -200], [90, 200])], 1)])
    true = np.array([geodesic.Inverse(*a, *b)["s12"] for a, b in pairs])
    np.testing.assert_allclose(haversine_m(pairs[:, 0], pairs[:, 1]), true, rtol=0.006)


@given(PLACES, PLACES)
def test_the_offset_is_distance_and_bearing(a, b):
    offset, distance = offset_m(a, b), haversine_m(a, b)
    assert np.hypot(*offset) == pytest.approx(distance, abs=1e-6)
    if 1 < distance < 2e7 and abs(a[0]) < 89.9:
        turned = math.radians(float(bearing_deg(a, b)))
        np.testing.assert_allclose(offset, distance * np.array([math.sin(turned), math.cos(turned)]), atol=1e-4)


@given(st.tuples(st.floats(-89.9, 89.9), st.floats(-180, 180)), st.floats(-2e6, 2e6), st.floats(-2e6, 2e6))
def test_moving_there_and_back(origin, east, north):
    there = moved(origin, (east, north))
    np.testing.assert_allclose(offset_m(origin, there), (east, north), atol=1e-6)
    assert -90 <= there[0] <= 90
    assert -180 <= there[1] < 180


def test_moved_by_hand():
    degree = math.radians(1) * EARTH_RADIUS_M
    np.testing.assert_allclose(moved((10, 20), (0, degree)), (11, 20), atol=1e-12)
    np.testing.assert_allclose(moved((0, 179.5), (degree, 0)), (0, -179.5), atol=1e-12)
    # Over the pole and down on the other side.
    np.testing.assert_allclose(moved((89.5, 0), (0, degree)), (89.5, -180), atol=1e-9)
    np.testing.assert_array_equal(moved((52.25, 13.5), (0, 0)), (52.25, 13.5))
    np.testing.assert_allclose(offset_m((0, -179.5), (0, 179.5)), (-degree, 0), atol=1e-6)


def test_bearings():
    for place, expected in (((1, 0), 0), ((0, 1), 90), ((-1, 0), 180), ((0, -1), 270), ((0, 0), 0)):
        assert bearing_deg((0, 0), place) == pytest.approx(expected, abs=1e-12)
    # A tiny bit west of north: not 360.
    assert 0 <= bearing_deg((0, 0), (1, -1e-20)) < 360
    geodesic = pytest.importorskip("geographiclib.geodesic").Geodesic.WGS84
    for a, b in itertools.pairwise(TOWNS[:5]):
        true = geodesic.Inverse(*a, *b)["azi1"]
        assert abs(wrapped_deg(bearing_deg(a, b) - true)) < 0.3


def test_wrapping():
    np.testing.assert_array_equal(
        wrapped_deg([-180, 179.5, 180, 540, -180.5, 0.1]), [-180, 179.5, -180, -180, 179.5, 0.1]
    )
    assert -180 <= wrapped_deg(np.nextafter(-180, -200)) < 180


@pytest.mark.parametrize("function", [haversine_m, offset_m, bearing_deg])
def test_impossible_places_are_refused(function):
    with pytest.raises(ValueError, match=r"from -90 to 90 degrees, got 90\.5"):
        function((0, 0), [(1, 1), (90.5, 1)])
    with pytest.raises(ValueError, match="finite"):
        function((0, float("nan")), (1, 1))
    with pytest.raises(ValueError, match=r"shape \(3,\)"):
        function((0, 0), (1, 2, 3))
    with pytest.raises(ValueError, match="finite offsets"):
        moved((0, 0), (math.inf, 0))
