"""Windows and other sizes of a map; its scale on the ground."""

import math

import numpy as np
import pytest

from diffnav.geometry.georeference import (
    AffineGeoreference,
    LocalMetres,
    bounds_georeference,
    corners_georeference,
    cropped,
    ground_sample_distance_m,
    metres_per_pixel,
    scaled,
)

WHOLE = corners_georeference((400, 600), [(50.2, 8.0), (50.21, 8.3), (50.0, 8.28), (49.99, 8.01)])
POINTS = np.array([[0.0, 0.0], [17.25, 33.5], [99.0, 49.0]])


def test_a_window_shares_the_whole_maps_places():
    part = cropped(WHOLE, (120, 200, 50, 100))
    assert part.size == (50, 100)
    np.testing.assert_allclose(part.latlon(POINTS), WHOLE.latlon(POINTS + np.array([200, 120])), atol=1e-12)
    np.testing.assert_allclose(part.pixels(part.latlon(POINTS)), POINTS, atol=1e-6)
    again = cropped(part, (3, 7, 10, 20))
    np.testing.assert_allclose(again.latlon([0, 0]), WHOLE.latlon([207, 123]), atol=1e-12)


def test_another_size_keeps_the_outer_edge():
    small = scaled(WHOLE, (100, 300))
    corners = np.array([[-0.5, -0.5], [299.5, -0.5], [299.5, 99.5], [-0.5, 99.5]])
    of_whole = np.array([[-0.5, -0.5], [599.5, -0.5], [599.5, 399.5], [-0.5, 399.5]])
    np.testing.assert_allclose(small.latlon(corners), WHOLE.latlon(of_whole), atol=1e-12)
    # The first pixel of a quarter as many rows is made of rows 0 to 3: its centre is at 1.5.
    np.testing.assert_allclose(small.latlon([0, 0]), WHOLE.latlon([0.5, 1.5]), atol=1e-12)
    np.testing.assert_allclose(small.pixels(small.latlon(POINTS)), POINTS, atol=1e-6)


def test_nothing_is_refused():
    for call in (lambda: cropped(WHOLE, (0, 0, 0, 5)), lambda: scaled(WHOLE, (0, 3))):
        with pytest.raises(ValueError, match="1 x 1 pixels or more"):
            call()


def test_scale_of_a_turned_map():
    """Rows that run 30 degrees north of east at .25 m a pixel, columns at .5 m."""
    cosine, sine = math.cos(math.radians(30)), math.sin(math.radians(30))
    transform = (0.25 * cosine, 0.5 * sine, 10, 0.25 * sine, -0.5 * cosine, 20)
    turned = AffineGeoreference((100, 100), LocalMetres((0.0, 0.0)), transform)
    expected = [[0.25 * cosine, 0.5 * sine], [0.25 * sine, -0.5 * cosine]]
    np.testing.assert_allclose(metres_per_pixel(turned, [[5, 5], [90, 3]]), [expected, expected], atol=1e-6)
    assert ground_sample_distance_m(turned) == pytest.approx(math.sqrt(0.25 * 0.5), rel=1e-6)


def test_scale_of_wildnavs_tiles():
    """The data's own description: 198.7 m x 172.7 m, .157-.166 m/px in both axes."""
    tile = bounds_georeference((1083, 1249), 60.403962, 22.460441, 60.402409, 22.464059)
    scale = metres_per_pixel(tile, [600, 500])
    assert scale[0, 0] * 1249 == pytest.approx(198.7, abs=0.05)
    assert -scale[1, 1] * 1083 == pytest.approx(172.7, abs=0.05)
    assert ground_sample_distance_m(tile, np.zeros((3, 2))).shape == (3,)
