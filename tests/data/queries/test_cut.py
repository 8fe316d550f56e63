"""Queries cut from maps: picture, truth, heading and scale agree with each other and with the map."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
import torch
from ramp_maps import ANY, DEGREE_M, PURE, SIZE, degrees_map, ramp_map

from diffnav.data.maps import world
from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.maps.world import world_maps
from diffnav.data.queries.cut import CutQuery, cut_queries
from diffnav.errors import UserError
from diffnav.geometry.georeference import AffineGeoreference, LocalMetres

MIDDLE = np.array([14.5, 9.5])
CORNERS = np.array([[-0.5, -0.5], [29.5, -0.5], [29.5, 19.5], [-0.5, 19.5]])


def mapped(query: CutQuery, points: Sequence | np.ndarray) -> np.ndarray:
    """(N, 2) map pixels, written out."""
    x, y, w = query.H_query_map.numpy() @ np.column_stack([points, np.ones(len(points))]).T
    return np.column_stack([x / w, y / w])


def metres(place: np.ndarray, origin: tuple[float, float]) -> np.ndarray:
    """East, north of an origin less than 100 m away, to a tenth of a millimetre."""
    latitude = math.radians((place[0] + origin[0]) / 2)
    return DEGREE_M * np.array([(place[1] - origin[1]) * math.cos(latitude), place[0] - origin[0]])


def test_truth_by_hand() -> None:
    geo_map = degrees_map()
    for query in cut_queries([geo_map], 6, 1, **ANY):
        ((x, y),) = mapped(query, [MIDDLE])
        latitude = 60 - (y + 0.5) * 0.3 / DEGREE_M
        longitude = 24 + (x + 0.5) * 0.5 / (DEGREE_M * math.cos(math.radians(60)))
        assert query.truth == pytest.approx((latitude, longitude), abs=1e-10)


def test_pictures_show_the_map_where_the_homography_says() -> None:
    """The colours of the ramp are the positions in it; 8 bit leaves half a level, .5 and .3 pixels."""
    for query in cut_queries([degrees_map()], 6, 2, camera=PURE, tilt=0.2, **ANY):
        day = query.read_day()
        points = [(x, y) for y in range(1, 19) for x in range(1, 29)]
        found = np.array([(day[0, y, x] * 240, day[1, y, x] * 160) for x, y in points])
        assert np.abs(found - mapped(query, points)).max() < 0.51


@pytest.mark.parametrize("turn_deg", [0.0, 30.0, 200.0])
def test_heading_and_scale_are_those_on_the_ground(turn_deg: float) -> None:
    """On maps that are turned, and have pixels that are no squares."""
    c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    turned = AffineGeoreference((160, 240), LocalMetres((60.0, 24.0)), (0.4 * c, 0.4 * s, 0, 0.4 * s, -0.4 * c, 0))
    for geo_map, metres_a_pixel in ((ramp_map(turned), 0.4), (degrees_map(), math.sqrt(0.5 * 0.3))):
        for query in cut_queries([geo_map], 4, 3, size=SIZE, heading_deg=120, scale=(0.6, 1.4), tilt=0.0):
            steps = np.array([MIDDLE, np.add(MIDDLE, (0, -8)), np.add(MIDDLE, (8, 0))])
            _, up, right = (metres(p, query.truth) for p in geo_map.georeference.latlon(mapped(query, steps)))
            assert math.hypot(*up) == pytest.approx(8 * query.ground_sample_distance_m, rel=1e-4)
            assert math.hypot(*right) == pytest.approx(8 * query.ground_sample_distance_m, rel=1e-4)
            heading_deg = math.degrees(math.atan2(*up)) % 360
            assert heading_deg == pytest.approx(query.heading_deg, abs=0.01)
            assert (math.degrees(math.atan2(*right)) - heading_deg) % 360 == pytest.approx(90, abs=0.01)
            assert query.heading_deg <= 120.01 or query.heading_deg >= 239.99
            assert 0.6 * 0.999 <= query.ground_sample_distance_m / metres_a_pixel <= 1.4 * 1.001


def test_level_flight_looks_north_at_the_map_s_scale() -> None:
    for query in cut_queries(world_maps(1, 1, (60, 80)), 3, size=SIZE):
        np.testing.assert_allclose(query.H_query_map[:2, :2], np.eye(2), atol=1e-6)
        assert min(query.heading_deg, 360 - query.heading_deg) < 1e-3
        assert query.ground_sample_distance_m == pytest.approx(0.3, rel=1e-6)


def test_a_tilt_bends_the_picture_but_not_its_middle() -> None:
    (flat,), (tilted,) = (cut_queries([degrees_map()], 1, 5, size=SIZE, tilt=tilt) for tilt in (0.0, 0.25))
    assert tilted.heading_deg == pytest.approx(flat.heading_deg, abs=1e-3)
    assert tilted.ground_sample_distance_m == pytest.approx(flat.ground_sample_distance_m, rel=1e-4)
    sides = np.diff(mapped(tilted, [(0, 0), (29, 0), (29, 19), (0, 19), (0, 0)]), axis=0)
    assert np.abs(sides[0] + sides[2]).max() > 0.5


def test_footprints_lie_wholly_on_the_map_and_reach_its_edges() -> None:
    outlines = np.array([mapped(q, CORNERS) for q in cut_queries([degrees_map()], 400, tilt=0.2, **ANY)])
    assert outlines.min() >= -0.5 - 1e-6
    assert outlines[..., 0].max() <= 239.5 + 1e-6
    assert outlines[..., 1].max() <= 159.5 + 1e-6
    assert outlines[..., 0].min() < 2
    assert outlines[..., 0].max() > 237
    assert outlines[..., 1].min() < 2
    assert outlines[..., 1].max() > 157


def test_poses_fill_their_ranges() -> None:
    queries = cut_queries([degrees_map()], 400, **ANY)
    scales = np.log2([query.ground_sample_distance_m / math.sqrt(0.5 * 0.3) for query in queries])
    # Four standard errors of the mean of 400 even draws.
    assert np.mean(scales) == pytest.approx(0, abs=4 * 2 / math.sqrt(12 * 400))
    assert scales.min() < -0.95
    assert scales.max() > 0.95
    quarters = np.histogram([query.heading_deg for query in queries], 4, (0, 360))[0]
    assert quarters.min() > 65


def test_a_picture_as_large_as_its_map_still_fits() -> None:
    geo_map = ramp_map(AffineGeoreference(SIZE, LocalMetres((10.0, 20.0)), (0.4, 0, 0, 0, -0.4, 0)))
    (query,) = cut_queries([geo_map], 1, size=SIZE, camera=PURE)
    np.testing.assert_allclose(mapped(query, CORNERS), CORNERS, atol=1e-5)
    assert (query.read_day()[:, :, 1:-1] - geo_map.picture()[:, :, 1:-1]).abs().max() < 0.02


def test_a_map_that_is_too_small_is_named() -> None:
    # 100 pixels of twice sqrt(.5 x .3) m are 258 of .3 m.
    with pytest.raises(UserError, match=r"^map ramp of 240 x 160 pixels is 1\.61 times too small for a query[^\n]+$"):
        cut_queries([degrees_map()], 1, size=(100, 100), scale=(2.0, 2.0))
    with pytest.raises(UserError, match=r"scale 1\.00 and heading"):
        cut_queries([degrees_map()], 50, size=(150, 230), heading_deg=180)


def test_worlds_are_rendered_where_the_map_shows_them(monkeypatch) -> None:
    """The map's own pixels, resampled, are the blurred rendering; a shift by three pixels is worse."""
    monkeypatch.setattr(world, "BLOCK", 80)
    (geo_map,) = world_maps(6, 1, (240, 320))
    picture = geo_map.picture()
    plain = GeoMap(geo_map.name, geo_map.georeference, lambda w: picture[:, w[0] : w[0] + w[2], w[1] : w[1] + w[3]], "")
    settings = {"size": (80, 120), "heading_deg": 180.0, "scale": (0.8, 1.2), "camera": PURE}
    pairs = zip(cut_queries([geo_map], 3, 4, **settings), cut_queries([plain], 3, 4, **settings), strict=True)
    for rendered, resampled in pairs:
        assert torch.equal(rendered.H_query_map, resampled.H_query_map)
        a, b = rendered.read_day(), resampled.read_day()
        assert not torch.equal(a, b)
        error, moved = ((a - b).square().mean(), (a[..., 3:] - b[..., :-3]).square().mean())
        assert error < 0.25 * moved
