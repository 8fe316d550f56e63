"""From a query to a fix by keypoints: found where it was cut, and no fix with a reason where it was not."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from localizing import PLAIN, SIFT, Counting, check_found, error_m, shown
from made_maps import ORIGIN, metres_from, picture_map
from made_noise import noise
from torch import Tensor

from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.queries.cut import CutQuery, cut_queries
from diffnav.data.queries.query import Query
from diffnav.errors import UserError
from diffnav.geometry.geodesy import haversine_m
from diffnav.matching.orb_gms import OrbGms
from diffnav.matching.surf import Surf
from diffnav.navigation.gates.gate import DefinitionGate, Never
from diffnav.navigation.localizer import Localizer, Search
from diffnav.navigation.preparation import Preparation
from diffnav.navigation.prior import Prior
from diffnav.navigation.reference import Reference
from diffnav.navigation.shortlist import ExactIndex, Shortlist, joined_offsets


def test_every_query_is_found_at_any_heading_and_scale(localizer: Localizer, world_queries: list[CutQuery]) -> None:
    for query in world_queries:
        fix = localizer.locate(query)
        check_found(fix, query, within_m=0.1)
        assert fix.matches >= fix.inliers >= 15
        assert set(fix.milliseconds) == {"read", "gate", "features", "match", "refine"}


def test_a_shortlist_finds_them_too_with_fewer_tiles(
    reference: Reference, localizer: Localizer, world_queries: list[CutQuery]
) -> None:
    index = ExactIndex([features.descriptors for features in reference.maps], bits=False)
    counting = Counting()
    short = Localizer(
        reference, counting, PLAIN, Shortlist(joined_offsets(reference.maps), index), search=Search(tiles=2, refined=1)
    )
    for number, query in enumerate(world_queries, 1):
        fix = short.locate(query)
        check_found(fix, query)
        assert counting.matched == 3 * number
        assert "shortlist" in fix.milliseconds
        assert error_m(fix, query) == pytest.approx(error_m(localizer.locate(query), query), abs=0.2)


def test_what_no_map_shows_is_no_fix(localizer: Localizer, other_queries: list[Query]) -> None:
    grain = torch.rand(3, 100, 100, generator=torch.Generator().manual_seed(1))
    for query in [*other_queries, shown(noise((240, 320), 77)), shown(grain)]:
        fix = localizer.locate(query)
        assert fix.status == "no_fix"
        assert fix.place is None
        assert len(fix.reasons) == 1
        assert "inliers" in fix.reasons[0] or "homography" in fix.reasons[0]


@pytest.mark.parametrize(
    ("picture", "reason"),
    [
        (torch.full((3, 240, 320), 0.5), "one colour"),
        (torch.zeros(3, 240, 320), "one colour"),
        (noise((31, 320), 1), "320 x 31 pixels, fewer than 32 a side"),
        (Path("missing.jpg"), "missing.jpg: no such file"),
        (torch.arange(320).expand(3, 240, 320) / 320, "no tile's matches agree on a homography"),
        (noise((32, 32), 1), "no tile's matches agree on a homography"),
    ],
    ids=["grey", "black", "small", "missing", "a ramp", "just large enough"],
)
def test_what_cannot_be_matched_is_no_fix_with_its_reason(
    localizer: Localizer, picture: Tensor | Path, reason: str
) -> None:
    query = shown(picture) if isinstance(picture, Tensor) else Query("photo", picture)
    fix = localizer.locate(query)
    assert (fix.status, fix.query, fix.place) == ("no_fix", "photo", None)
    assert len(fix.reasons) == 1
    assert reason in fix.reasons[0]


def test_a_dark_query_is_found_once_it_is_enhanced(reference: Reference, world_queries: list[CutQuery]) -> None:
    query = world_queries[2]
    dark = shown((query.read() ** 4 * 255).round() / 255)
    gate = DefinitionGate(float(Never().enhances(query.read())[1]["definition"]) / 2)
    fix = Localizer(reference, SIFT, Preparation(gate, lambda image: image**0.25)).locate(dark)
    assert fix.status == "fix", fix.reasons
    assert fix.enhanced
    assert "enhance" in fix.milliseconds
    assert float(haversine_m(np.array(fix.place), np.array(query.truth))) < 0.5


def test_tilted_queries_are_found(localizer: Localizer, world_map: GeoMap) -> None:
    (query,) = cut_queries([world_map], 1, 5, size=(240, 320), heading_deg=180.0, scale=(0.8, 0.9), tilt=0.1, dark=0.0)
    check_found(localizer.locate(query), query)


def test_orb_gms_finds_textured_queries(store: Callable) -> None:
    geo_map = picture_map(noise((400, 500), 5), "textured")
    localizer = Localizer(store([geo_map], OrbGms(3000, scale=True)), OrbGms(1500, scale=True), PLAIN)
    queries = cut_queries([geo_map], 4, size=(240, 320), heading_deg=180.0, scale=(0.8, 1.0), dark=0.0)
    for query in queries:
        check_found(localizer.locate(query), query)
        # As bits, the shortlist's index says the same.
    (features,) = localizer.reference.maps
    index = ExactIndex([features.descriptors], bits=True)
    votes = Shortlist(joined_offsets([features]), index).votes(localizer.matcher.features(queries[0].read()))
    assert votes[0] > 0
    other = localizer.locate(shown(noise((240, 320), 6)))
    assert other.status == "no_fix"
    assert localizer.locate(shown(torch.full((3, 64, 64), 0.5) + noise((64, 64), 1) / 9)).status == "no_fix"


def test_a_sweep_of_headings_finds_what_an_upright_matcher_does_not(
    store: Callable, world_map: GeoMap, world_queries: list[CutQuery]
) -> None:
    upright = Surf(600, upright=True)
    reference = store([world_map], Surf(1200, upright=True))
    for query in world_queries[:2]:
        heading_deg = query.heading_deg or 0
        assert abs((heading_deg + 180) % 360 - 180) > 45
        alone = Localizer(reference, upright, PLAIN).locate(query)
        assert alone.status == "no_fix"
        headings = (0.0, round(heading_deg / 30) * 30.0, 45.0)
        swept = Localizer(reference, upright, PLAIN, search=Search(headings_deg=headings)).locate(query)
        check_found(swept, query)
        told = Localizer(reference, upright, PLAIN).locate(query, Prior(heading_deg=heading_deg))
        check_found(told, query)


def test_a_query_larger_than_the_map_is_found(store: Callable) -> None:
    """A map of 200 x 300 in the middle of a picture of 400 x 620, of which the rest is another's."""
    picture = noise((200, 300), 3)
    localizer = Localizer(store([picture_map(picture, "small")], SIFT), SIFT, PLAIN)
    large = noise((400, 620), 4)
    large[:, 80:280, 170:470] = picture
    fix = localizer.locate(shown(large))
    assert fix.status == "fix", fix.reasons
    assert fix.place is not None
    # The picture's middle, (309.5, 199.5), is the map's pixel (139.5, 119.5) of half a metre.
    assert metres_from(ORIGIN, fix.place) == pytest.approx((69.75, -59.75), abs=0.05)
    assert fix.ground_sample_distance_m == pytest.approx(0.5, rel=1e-3)
    assert metres_from(ORIGIN, fix.footprint[0]) == pytest.approx((-85, 40), abs=0.2)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"winner": "most"}, "search.winner must be inliers or matches, got 'most'"),
        ({"tiles": 0}, "search.tiles must be 1 or more, got 0"),
        ({"longest_side": 0}, "search.longest_side"),
        ({"refined": -1}, "search.refined"),
        ({"headings_deg": ()}, r"search.headings_deg is empty; write \[0\] for no turn"),
    ],
)
def test_settings_out_of_range_are_named(settings: dict, message: str) -> None:
    with pytest.raises(UserError, match=message):
        Search(**settings)
