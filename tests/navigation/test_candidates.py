"""One tile as a candidate, and the closer look at the ground around it."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import torch
from made_maps import DEGREE_M, ORIGIN, metres_from, picture_map, placed_features
from made_noise import noise
from torch import Tensor

from diffnav.geometry.homography import apply_homography
from diffnav.matching.matches import Features, Matches
from diffnav.matching.sift import Sift
from diffnav.navigation.alignment import Aligned, align
from diffnav.navigation.candidates import Candidate, look_closely, try_tile
from diffnav.navigation.feature_store import stored_features
from diffnav.navigation.reference import Reference
from diffnav.navigation.tiles import tile_windows

PICTURE = noise((200, 400), 8)
SIFT = Sift(800)
# The query: 90 x 120 pixels of the map from (140, 60) on, turned by half.
QUERY = PICTURE[:, 60:150, 140:260].rot90(2, (1, 2)).contiguous()


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Reference:
    """Two tiles side by side; the first ends at the query's middle."""
    geo_map = picture_map(PICTURE, pixel_m=0.5)
    return Reference(
        [stored_features(geo_map, tile_windows((200, 400), (200, 200)), SIFT, tmp_path_factory.mktemp("f"))]
    )


def tried(reference: Reference, tile: int, scale: float = 1.0, heading_deg: float = 0.0) -> Candidate:
    aligned = align(QUERY, scale, heading_deg)
    return try_tile(aligned, aligned.features(SIFT), tile, reference, SIFT, 3.0)


@pytest.mark.parametrize(("scale", "heading_deg"), [(1.0, 0.0), (1.5, 180.0), (1.2, 40.0)])
def test_a_tile_that_shows_half_of_the_query_says_where_all_of_it_lies(
    reference: Reference, scale: float, heading_deg: float
) -> None:
    """The query's middle is the map's pixel (199.5, 104.5): 99.75 m east and 52.25 m south of the origin."""
    for tile in (0, 1):
        candidate = tried(reference, tile, scale, heading_deg)
        assert candidate.tile == tile
        assert candidate.matches >= candidate.inliers > 15
        assert candidate.place is not None
        assert metres_from(ORIGIN, candidate.place) == pytest.approx((99.75, -52.25), abs=0.3)
        assert candidate.radius_m == pytest.approx(0.5 * math.hypot(119, 89) / 2, abs=0.5)


@pytest.mark.parametrize(("scale", "heading_deg"), [(1.0, 0.0), (1.2, 40.0)])
def test_the_closer_look_has_the_features_of_both_tiles(reference: Reference, scale: float, heading_deg: float) -> None:
    candidate = tried(reference, 0, scale, heading_deg)
    view = look_closely(candidate, reference, SIFT, 3.0)
    assert view is not None
    assert view.query_size == (90, 120)
    assert view.matches >= len(view.points_query) > 1.5 * candidate.inliers
    assert len(view.points_ground) == len(view.points_query)
    # All over the query, not in one half of it: in its own pixels, whatever picture was matched.
    assert view.points_query[:, 0].min() < 15
    assert view.points_query[:, 0].max() > 105
    off = apply_homography(view.H_query_ground, view.points_query) - view.points_ground
    assert off.norm(dim=1).max() <= 3.0 + 1e-3
    assert off.mean(0).norm() < 0.1
    middle = apply_homography(view.H_query_ground, torch.tensor([[59.5, 44.5]])).numpy()
    assert metres_from(ORIGIN, view.ground.latlon(middle)[0]) == pytest.approx((99.75, -52.25), abs=0.03)
    # Turned by half: the query's first pixel is the map's (259, 149).
    first = apply_homography(view.H_query_ground, torch.tensor([[0.0, 0.0]])).numpy()
    assert metres_from(ORIGIN, view.ground.latlon(first)[0]) == pytest.approx((129.5, -74.5), abs=0.06)


def test_a_tile_that_shows_something_else_has_no_place(tmp_path: Path) -> None:
    other = stored_features(picture_map(noise((200, 200), 9)), tile_windows((200, 200), (200, 200)), SIFT, tmp_path)
    flat = stored_features(picture_map(torch.full((3, 200, 200), 0.5), "flat"), [(0, 0, 200, 200)], SIFT, tmp_path)
    reference = Reference([other, flat])
    for tile in (0, 1):
        candidate = tried(reference, tile)
        assert candidate.inliers < 6
        assert candidate.place is None
        assert look_closely(candidate, reference, SIFT, 3.0) is None
    assert tried(reference, 1).matches == 0


class Pairs:
    """Matches given by hand."""

    name = "pairs"

    def __init__(self, points_a: Tensor, points_b: Tensor) -> None:
        self.settings: Mapping[str, Any] = {}
        self.matches = Matches(points_a, points_b, torch.ones(len(points_a)), self.name, self.settings)

    def features(self, image: Tensor) -> Features:
        raise NotImplementedError

    def match(self, a: Features, b: Features) -> Matches:  # noqa: ARG002
        return self.matches


NOTHING = Features(torch.zeros(0, 2), torch.zeros(0, 1), torch.zeros(0), (100, 200))


def given(H: list[list[float]], count: int = 20) -> Candidate:
    """A query of 100 x 200 whose points in its upper left tenth are matched with a tile of 300 x 400 by H."""
    points = torch.rand(count, 2, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    points = points * torch.tensor([20.0, 10])
    matcher = Pairs(points.float(), apply_homography(torch.tensor(H, dtype=torch.float64), points).float())
    aligned = Aligned(torch.zeros(3, 100, 200), torch.eye(3, dtype=torch.float64), (100, 200))
    return try_tile(aligned, NOTHING, 0, Reference([placed_features([], size=(300, 400))]), matcher, 3.0)


def test_a_place_far_outside_of_the_tile_is_none() -> None:
    """From 800 pixels beyond its edges on: the tile's longer side is 400."""
    assert given([[1, 0, 90], [0, 1, 50], [0, 0, 1]]).place is not None
    assert given([[1, 0, 990], [0, 1, 50], [0, 0, 1]]).place is not None
    assert given([[1, 0, 1010], [0, 1, 50], [0, 0, 1]]).place is None
    assert given([[1, 0, 90], [0, 1, -810], [0, 0, 1]]).place is None
    # The lower right corner lies far outside.
    assert given([[7, 0, 0], [0, 7, 0], [0, 0, 1]]).place is None
    # It lies beyond the horizon, or on it.
    assert given([[1, 0, 90], [0, 1, 50], [-1 / 199, 0, 1]]).place is None
    far = given([[1, 0, 990], [0, 1, 50], [0, 0, 1]])
    assert far.place is not None
    assert metres_from(ORIGIN, far.place) == pytest.approx((0.5 * (990 + 99.5), -0.5 * (50 + 49.5)), abs=0.05)


def test_six_inliers_are_needed() -> None:
    shift: list[list[float]] = [[1, 0, 90], [0, 1, 50], [0, 0, 1]]
    assert given(shift, 5).place is None
    assert given(shift, 5).inliers == 5
    assert given(shift, 6).place is not None
    assert given(shift, 3).inliers == 0


@pytest.mark.parametrize(("metres", "elsewhere"), [(0.0, False), (36.0, False), (38.5, True), (1e6, True)])
def test_elsewhere_is_outside_of_the_circle_that_holds_the_query(
    reference: Reference, metres: float, elsewhere: bool
) -> None:
    """The query's middle lies 52.25 m south of the origin, its corners 37.1 m from there."""
    view = look_closely(tried(reference, 0), reference, SIFT, 3.0)
    assert view is not None
    assert metres_from(ORIGIN, view.place) == pytest.approx((99.75, -52.25), abs=0.03)
    assert view.is_elsewhere((view.place[0] + metres / DEGREE_M, view.place[1])) == elsewhere
    assert not view.is_elsewhere(None)
