"""Queries of known place, heading and scale, found by correlation across seasons, or not at all."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from made_maps import ORIGIN, metres_from, picture_map
from made_noise import noise
from torch import Tensor

from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.queries.cut import CutQuery
from diffnav.data.queries.query import Query
from diffnav.errors import UserError
from diffnav.geometry.geodesy import haversine_m, moved
from diffnav.geometry.homography import homography_corner_error_px
from diffnav.navigation import correlator
from diffnav.navigation.correlator import CorrelationSearch, Correlator
from diffnav.navigation.gates.gate import Never
from diffnav.navigation.preparation import Preparation
from diffnav.navigation.prior import NOTHING, Prior

PLAIN = Preparation(Never(), lambda image: image)
SMALL = CorrelationSearch(longest_side=128)


def winter(image: Tensor) -> Tensor:
    """Dark and bright exchanged, colours too, and half of the contrast."""
    return 0.8 - 0.5 * image.roll(1, 0)


def prior_of(query: Query, radius_m: float = 20.0, turn: float = 0.0, scale: float = 1.0) -> Prior:
    """Not the place itself but one 11 m away."""
    place = moved(query.truth or (47.0, 8.0), (9.0, -6.3))
    pixel_m = (query.ground_sample_distance_m or 0) * scale
    return Prior((float(place[0]), float(place[1])), radius_m, (query.heading_deg or 0) + turn, pixel_m)


@pytest.mark.parametrize(("turn", "scale"), [(3.0, 1.04), (-2.0, 0.96)])
def test_queries_of_another_season_are_found(
    world_map: GeoMap, world_queries: list[CutQuery], turn: float, scale: float
) -> None:
    for query in world_queries[:3]:
        image = winter(query.read())
        seen = replace(query, image=lambda image=image: image)
        fix = Correlator([world_map], PLAIN, SMALL).locate(seen, prior_of(query, 20.0, turn, scale))
        assert fix.status == "fix", fix.reasons
        assert fix.place is not None
        # A pixel as correlated measures about .6 m.
        assert haversine_m(np.array(fix.place), np.array(query.truth)) < 0.3
        assert abs(((fix.heading_deg or 0) - (query.heading_deg or 0) + 180) % 360 - 180) <= 1.51
        assert fix.ground_sample_distance_m == pytest.approx(query.ground_sample_distance_m, rel=0.031)
        assert fix.H_query_map is not None
        assert homography_corner_error_px(fix.H_query_map, query.H_query_map, (240, 320)) < 6
        assert (fix.map, fix.tile, fix.inliers) == (world_map.name, None, 0)
        assert 0 < (fix.sigma_m or 0) < 3
        assert {"read", "gate", "match"} == set(fix.milliseconds)


def test_a_query_of_another_place_is_no_fix(world_map: GeoMap, other_queries: Sequence[Query]) -> None:
    middle = world_map.georeference.latlon([449.5, 299.5])
    for query in other_queries:
        fix = Correlator([world_map], PLAIN, SMALL).locate(replace(query, truth=tuple(middle)), prior_of(query))
        assert (fix.status, fix.place) == ("no_fix", None)
        assert all(reason.startswith(("correlation 0.", "another place fits ")) for reason in fix.reasons)
        assert fix.reasons


def test_a_place_outside_of_the_circle_is_not_taken(world_map: GeoMap, world_queries: list[CutQuery]) -> None:
    """The right place lies 11 m from the middle of a circle of 8 m."""
    query = world_queries[0]
    assert Correlator([world_map], PLAIN, SMALL).locate(query, prior_of(query, 8.0)).status == "no_fix"


@pytest.mark.parametrize("missing", ["place", "radius_m", "heading_deg", "ground_sample_distance_m"])
def test_all_of_the_prior_is_needed(world_map: GeoMap, world_queries: list[CutQuery], missing: str) -> None:
    prior = replace(prior_of(world_queries[0]), **{missing: None})
    for known in (prior, NOTHING):
        fix = Correlator([world_map], PLAIN, SMALL).locate(world_queries[0], known)
        assert fix.status == "no_fix"
        assert fix.reasons == ("correlation needs an expected place, heading and scale",)


def test_what_cannot_be_used_is_no_fix(world_map: GeoMap, world_queries: list[CutQuery]) -> None:
    query, search = world_queries[0], Correlator([world_map], PLAIN, SMALL)
    missing = search.locate(Query("photo", Path("missing.jpg")), prior_of(query))
    assert missing.reasons == ("missing.jpg: no such file",)
    black = search.locate(Query("photo", lambda: torch.zeros(3, 240, 320)), prior_of(query))
    assert "one colour" in black.reasons[0]
    ramp = Query("photo", lambda: torch.full((3, 240, 320), 0.5) + torch.arange(320) / 1e5)
    assert search.locate(ramp, prior_of(query)).status == "no_fix"
    far = search.locate(query, replace(prior_of(query), place=(-30.0, 100.0)))
    assert far.reasons == ("no map shows the expected place",)
    assert Correlator([], PLAIN).locate(query, prior_of(query)).reasons == far.reasons


def test_a_circle_that_would_fill_the_memory_is_refused(
    world_map: GeoMap, world_queries: list[CutQuery], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(correlator, "ground_picture", None)
    fix = Correlator([world_map], PLAIN, SMALL).locate(world_queries[0], prior_of(world_queries[0], 5000.0))
    assert fix.status == "no_fix"
    assert fix.reasons[0].startswith("a circle of 5000 m is ")
    assert "too large to correlate" in fix.reasons[0]


PICTURE = noise((260, 300), 11)


def cut(y: int, x: int, height: int = 90, width: int = 120) -> Query:
    """A piece of the picture as it is, half a metre a pixel, with north at its top."""
    return Query("piece", lambda: PICTURE[:, y : y + height, x : x + width])


def known(east: float, north: float, radius_m: float) -> Prior:
    place = moved(ORIGIN, (east, north))
    return Prior((float(place[0]), float(place[1])), radius_m, 0.0, 0.5)


@pytest.mark.parametrize("radius_m", [2.0, 7.0, 25.0])
def test_the_middle_of_the_circle_is_the_expected_place(radius_m: float) -> None:
    """A piece whose middle is the map's pixel (149.5, 134.5), just inside and just outside of the circle."""
    search = CorrelationSearch(longest_side=120, headings_deg=(0.0,), scales=(1.0,))
    query, middle = cut(90, 90), (149.5 / 2, -134.5 / 2)
    for east, north in ((1, 0), (-1, 0), (0, 1), (0, -1), (0.71, 0.71), (-0.71, -0.71)):
        for off_m, status in ((0.95 * radius_m, "fix"), (radius_m + 1.2, "no_fix")):
            prior = known(middle[0] + off_m * east, middle[1] + off_m * north, radius_m)
            fix = Correlator([picture_map(PICTURE)], PLAIN, search).locate(query, prior)
            assert fix.status == status, (east, north, fix.reasons)
            if fix.place is not None:
                assert metres_from(ORIGIN, fix.place) == pytest.approx(middle, abs=0.05)


def test_at_the_corner_of_a_map_what_is_shown_counts() -> None:
    """The circle reaches beyond the map; where it ends is no edge of anything."""
    search = CorrelationSearch(longest_side=120, headings_deg=(0.0,), scales=(1.0,))
    middle = (59.5 / 2, -44.5 / 2)
    for season in (lambda image: image, winter):
        query = Query("piece", lambda season=season: season(PICTURE[:, :90, :120]))
        fix = Correlator([picture_map(PICTURE)], PLAIN, search).locate(query, known(20.0, -15.0, 25.0))
        assert fix.status == "fix", fix.reasons
        assert fix.place is not None
        assert metres_from(ORIGIN, fix.place) == pytest.approx(middle, abs=0.1)


def test_where_a_map_ends_is_no_edge_of_the_ground() -> None:
    """A query with a strong edge, of another place: it fits no better where the map ends in black than elsewhere."""
    image = 0.6 + 0.05 * noise((90, 120), 2)
    image[:, :, 60:] -= 0.55
    strict = CorrelationSearch(longest_side=120, headings_deg=(0.0,), scales=(1.0,), min_score=1.0)
    geo_map = picture_map(0.6 + 0.05 * noise((260, 300), 1))
    fix = Correlator([geo_map], PLAIN, strict).locate(Query("edge", lambda: image), known(149.0, -65.0, 30.0))
    told = re.match(r"correlation (\d\.\d\d), less than 1.0", fix.reasons[0])
    assert told is not None
    assert float(told[1]) < 0.2


def test_maps_are_joined() -> None:
    """Two halves of the picture, of different pixel sizes, each showing half of the query."""
    east = torch.nn.functional.interpolate(PICTURE[None, :, :, 150:], scale_factor=2, mode="bilinear")[0]
    # Twice as many pixels: their first centre lies a quarter of a pixel before the coarser one's.
    halves = [
        picture_map(PICTURE[..., :150], "west"),
        picture_map(east, "east", (150 * 0.5 - 0.125, 0.125), 0.25),
    ]
    query = cut(100, 105)
    middle = ((105 + 59.5) / 2, -(100 + 44.5) / 2)
    search = CorrelationSearch(longest_side=120, headings_deg=(0.0,), scales=(1.0,))
    fix = Correlator(halves, PLAIN, search).locate(query, known(middle[0] + 5, middle[1] + 5, 15.0))
    assert fix.status == "fix", fix.reasons
    assert fix.place is not None
    assert metres_from(ORIGIN, fix.place) == pytest.approx(middle, abs=0.15)
    assert fix.map == "east"


def test_a_place_that_is_there_twice_is_no_fix() -> None:
    twice = torch.cat([PICTURE[..., 90:210], PICTURE[..., 90:210]], 2)
    query = cut(90, 90)
    search = CorrelationSearch(longest_side=120, headings_deg=(0.0,), scales=(1.0,))
    prior = known(60.0, -134.5 / 2, 45.0)
    fix = Correlator([picture_map(twice)], PLAIN, search).locate(query, prior)
    assert fix.status == "no_fix"
    assert fix.reasons[0] in {f"another place fits {share}% as well" for share in (99, 100, 101)}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"longest_side": 31}, "correlation.longest_side must be 32 or more, got 31"),
        ({"headings_deg": []}, r"correlation.headings_deg is empty; write \[0\] for the expected heading alone"),
        ({"scales": []}, r"correlation.scales must be some factors above 0, got \[\]"),
        ({"scales": [1.0, 0.0]}, "correlation.scales"),
    ],
)
def test_settings_out_of_range_are_named(settings: dict, message: str) -> None:
    with pytest.raises(UserError, match=message):
        CorrelationSearch(**settings)
