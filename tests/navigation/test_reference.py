"""Maps searched as one: their tiles' places, and the features of a piece of ground that several maps show."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from made_maps import DEGREE_M, ORIGIN, metres_from, placed_features
from made_noise import noise

from diffnav.data.maps.geo_map import GeoMap
from diffnav.errors import UserError
from diffnav.matching.orb_gms import OrbGms
from diffnav.navigation.map_features import MapFeatures
from diffnav.navigation.reference import Reference
from diffnav.navigation.tiles import tile_windows


def found_at(
    reference: Reference, radius_m: float, tile: int, place: tuple[float, float] = ORIGIN
) -> dict[float, list]:
    """Descriptor -> keypoint of a region."""
    region = reference.region(place, radius_m, tile)
    return dict(zip(region.features.descriptors[:, 0].tolist(), region.features.keypoints.tolist(), strict=True))


def test_a_region_across_two_maps_of_different_pixel_sizes() -> None:
    """West of the origin .5 m a pixel, east of it .4 m: in one square of 60 m, in pixels of the tile's map.

    The square's first pixel lies 30 m west and 30 m north of the origin.
    """
    west = placed_features([(99, 60), (45, 40), (30, 60)], "west", (120, 100), (-49.75, 30.0), 0.5)
    east = placed_features([(0, 50), (70, 90.5), (80, 50)], "east", (150, 100), (0.2, 25.0), 0.4)
    # East and north of the origin, metres; the last of each lies outside of the square.
    places = {1: (-0.25, 0.0), 2: (-27.25, 10.0), 11: (0.2, 5.0), 12: (28.2, -11.2)}
    east = replace(east, descriptors=east.descriptors + 10)
    reference = Reference([west, east])
    for tile, pixel_m in ((0, 0.5), (1, 0.4)):
        region = reference.region(ORIGIN, 30.0, tile)
        assert region.ground.pixel_m == pytest.approx(pixel_m, rel=1e-6)
        assert metres_from(ORIGIN, region.ground.origin) == pytest.approx((-30, 30), abs=1e-3)
        assert region.features.size == (round(60 / pixel_m), round(60 / pixel_m))
        found = found_at(reference, 30.0, tile)
        assert sorted(found) == sorted(places)
        for number, (x, y) in places.items():
            assert found[number] == pytest.approx([(x + 30) / pixel_m, (30 - y) / pixel_m], abs=1e-3)


def test_where_maps_overlap_the_tiles_own_comes_first() -> None:
    """Both show from 0 to 49.5 m east; `other` shows from 25 m on."""
    one = placed_features([(10, 50), (60, 50), (90, 50)], "one", corner=(0, 25))
    other = placed_features([(10.2, 50), (45, 50), (52, 50), (90, 50)], "other", corner=(25, 25))
    third = placed_features([(10, 50), (90, 50)], "third", corner=(40, 25))
    parts = [replace(m, descriptors=m.descriptors + 10 * k) for k, m in enumerate((one, other, third))]
    reference = Reference(parts)
    middle = tuple(reference.places[1])
    # `one` has some at 5, 30 and 45 m, `other` at 30.1, 47.5, 51 and 70 m, the third, which shows 40 to 89.5 m, at 45
    # and 85 m.
    assert sorted(found_at(reference, 60, 0, middle)) == [1, 2, 3, 13, 14, 22]
    assert sorted(found_at(reference, 60, 1, middle)) == [1, 11, 12, 13, 14, 22]
    assert sorted(found_at(reference, 60, 2, middle)) == [1, 2, 21, 22]


def test_the_strongest_come_first_and_all_lie_inside() -> None:
    """GMS wants keypoints from nothing to below the size; half a pixel before the first is still on the map."""
    one = placed_features([(0, 20), (10, 20), (20, 20)], "one", corner=(-10, 10), scores=[1, 5, 3])
    other = placed_features([(0, 20), (10, 20)], "other", corner=(45, 10), scores=[4, 2])
    found = Reference([one, other]).region(ORIGIN, 9.9, 0).features
    assert found.scores.tolist() == [5, 3, 1]
    assert found.keypoints[2, 0] == 0
    everything = Reference([one, other]).region(ORIGIN, 80, 0).features
    assert everything.scores.tolist() == [5, 4, 3, 2, 1]
    for features in (found, everything):
        assert (features.keypoints >= 0).all()
        assert (features.keypoints < features.size[0]).all()


def test_a_region_of_bits_can_be_matched_with_gms() -> None:
    """Two halves of one picture, each a map: a piece of the whole is found in their region."""
    picture, matcher = noise((200, 300), 3), OrbGms(900, threshold_factor=4)
    halves = []
    for k in (0, 1):
        own = matcher.features(picture[..., 150 * k : 150 * k + 150])
        halves.append(
            placed_features(
                own.keypoints.tolist(), f"half {k}", own.size, (75.0 * k, 0.0),
                descriptors=own.descriptors.numpy(), scores=own.scores.tolist(),
            )
        )  # fmt: skip
    reference = Reference(halves)
    place = (ORIGIN[0] - 49.75 / DEGREE_M, ORIGIN[1] + 74.75 / (DEGREE_M * math.cos(math.radians(ORIGIN[0]))))
    region = reference.region(place, 100.0, 0)
    assert region.features.descriptors.dtype == torch.uint8
    matches = matcher.match(matcher.features(picture[:, 40:160, 60:240]), region.features)
    assert len(matches) > 20
    # The square's middle is the picture's.
    expected = matches.points_a + torch.tensor([60.0, 40.0]) + torch.tensor([200 - 149.5, 200 - 99.5])
    assert (matches.points_b - expected).norm(dim=1).median() < 0.01


def test_maps_without_features_and_places_without_maps() -> None:
    for kind in (np.uint8, np.float32):
        full = placed_features([(50, 50)], "full", descriptors=np.full((1, 8), 3, kind))
        empty = placed_features([], "empty", corner=(30.0, 0.0), descriptors=np.zeros((0, 8), kind))
        reference = Reference([empty, full])
        assert reference.region(tuple(reference.places[0]), 60, 0).features.descriptors.tolist() == [[3] * 8]
        nothing = reference.region((48.0, 8.0), 60, 1).features
        assert len(nothing) == 0
        assert nothing.descriptors.shape == (0, 8)
        assert nothing.descriptors.dtype == torch.from_numpy(full.descriptors).dtype
        assert len(reference.region(tuple(reference.places[0]), 1.0, 0).features) == 0


def test_maps_far_away_are_not_asked() -> None:
    """Of many thousand maps; some of them could not even say where the place would lie."""

    class Faraway:
        size = (100, 100)

        def __init__(self, near: MapFeatures) -> None:
            self.near = near.map.georeference

        def latlon(self, points: np.ndarray) -> np.ndarray:
            return self.near.latlon(points) + np.array([0, 90.0])

        def pixels(self, latlon: np.ndarray) -> np.ndarray:
            raise AssertionError(f"asked for {latlon}")

    near = placed_features([(50, 50)], "near")
    far_map = GeoMap("far", Faraway(near), near.map.read, "far")  # type: ignore[arg-type]
    reference = Reference([replace(near, map=far_map), near])
    assert sorted(found_at(reference, 30, 1, tuple(reference.places[1]))) == [1]


def test_tiles_that_reach_into_a_circle_are_near() -> None:
    """Tiles of 30 x 40 m, 25 m from middle to corner; their middles 30 m apart along the map's 6 columns."""
    features = placed_features([], size=(100, 600), corner=(0.25, -0.25))
    cut = replace(features, windows=tuple(tile_windows((100, 600), (100, 100))), offsets=np.zeros(7, int))
    wide = placed_features([], "wide", (60, 80), (0.25, 1000.0))
    reference = Reference([cut, wide])
    assert len(reference) == 7
    assert reference.radii_m[:6] == pytest.approx([math.hypot(25, 25)] * 6, rel=1e-4)
    assert reference.radii_m[6] == pytest.approx(25, rel=1e-4)
    assert reference.pixel_m == pytest.approx([0.5] * 7, rel=1e-6)
    middles = [metres_from(ORIGIN, place) for place in reference.places]
    assert middles[:6] == [pytest.approx((25 + 50 * k, -25), abs=0.01) for k in range(6)]
    assert middles[6] == pytest.approx((20, 985.25), abs=0.01)
    place = tuple(reference.places[2])
    reach = 35.3554
    for radius_m, expected in ((0.1, [2]), (50 - reach - 0.1, [2]), (50 - reach + 0.1, [1, 2, 3]), (100.0, range(5))):
        assert reference.near(place, radius_m).tolist() == list(expected)
    assert reference.near((-40.0, 100.0), 1000.0).tolist() == []
    assert reference.near((-40.0, 100.0), 1e9).tolist() == list(range(7))


def test_over_the_antimeridian() -> None:
    """A map from 25 m west of it to 25 m east; one that ends 75 m west; one that begins 75 m east."""
    origin = (-20.0, 180.0)
    maps = [
        placed_features([(50, 50)], name, corner=(east, 25), origin=origin)
        for name, east in (("over", -25.0), ("west", -124.5), ("east", 75.0))
    ]
    reference = Reference(maps)
    degree_m = DEGREE_M * math.cos(math.radians(20))
    for side in (-1, 1):
        place = (-20.0, side * (180 - 30 / degree_m))
        assert reference.near(place, 1.0).tolist() == [0]
        assert reference.near(place, 40.0).tolist() == [0, 1 if side > 0 else 2]
        region = reference.region(place, 140.0, 0)
        # East of the square's first pixel, 140 m west of the place: the three maps' middles. Meridians spread by a
        # millimetre over 140 m.
        offset = 140 + 30 * side
        expected = [(offset + east) / 0.5 for east in (0.0, -99.5, 100.0)]
        assert region.features.keypoints[:, 0].tolist() == pytest.approx(expected, abs=5e-3)


def test_tiles_are_named_after_their_first_pixel() -> None:
    one = placed_features([], "one", (64, 100))
    cut = replace(one, windows=tuple(tile_windows((64, 100), (64, 64), 0.4)), offsets=np.zeros(3, int))
    reference = Reference([placed_features([(1, 2)], "first"), cut])
    assert [reference.name(k) for k in range(3)] == ["first/0,0", "one/0,0", "one/0,36"]
    assert reference.tile(0).keypoints.tolist() == [[1, 2]]


def test_what_is_no_reference_is_told_in_a_sentence() -> None:
    with pytest.raises(UserError, match="map= gives no map: name an image with a georeference"):
        Reference([])
    one = placed_features([], "same")
    with pytest.raises(UserError, match="2 maps are called same: give their files different names"):
        Reference([placed_features([], "other"), one, one])
