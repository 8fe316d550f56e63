"""What is known of a query beforehand narrows its search, sets its scale, and refutes what says otherwise."""

import pytest
from localizing import PLAIN, SIFT, Counting, check_found
from made_maps import ORIGIN
from torch import Tensor

from diffnav.data.queries.cut import CutQuery
from diffnav.data.queries.query import Query
from diffnav.geometry.geodesy import moved
from diffnav.matching.matches import Features
from diffnav.navigation.localizer import Localizer, Search
from diffnav.navigation.prior import Prior
from diffnav.navigation.reference import Reference


def near(query: Query, east: float, north: float) -> tuple[float, float]:
    assert query.truth is not None
    latitude, longitude = moved(query.truth, (east, north))
    return float(latitude), float(longitude)


def test_a_right_prior_narrows_the_search(reference: Reference, world_queries: list[CutQuery]) -> None:
    """Tiles of 120 x 150 m: a circle of 10 m meets some of seven."""
    query, counting = world_queries[0], Counting()
    prior = Prior(near(query, 5, -6), 10.0, (query.heading_deg or 0) + 8, (query.ground_sample_distance_m or 0) * 1.1)
    fix = Localizer(reference, counting, PLAIN, search=Search(refined=1)).locate(query, prior)
    check_found(fix, query)
    assert counting.matched == 1 + len(reference.near(prior.place or ORIGIN, 10.0))
    assert 1 < counting.matched < 7


def test_a_prior_that_excludes_the_place_is_no_fix(localizer: Localizer, world_queries: list[CutQuery]) -> None:
    query = world_queries[0]
    nowhere = localizer.locate(query, Prior((-30.0, 100.0), 1000.0))
    assert nowhere.reasons == ("no map shows the expected place",)
    beside = localizer.locate(query, Prior(near(query, 0, 50), 49.0))
    assert beside.status == "no_fix"
    assert beside.reasons == ("50 m from the expected place, more than 49 m",)
    assert beside.inliers > 15
    assert localizer.locate(query, Prior(near(query, 0, 50), 51.0)).status == "fix"


def test_a_prior_of_heading_or_scale_that_is_wrong_is_no_fix(
    localizer: Localizer, world_queries: list[CutQuery]
) -> None:
    query = world_queries[0]
    turned = localizer.locate(query, Prior(heading_deg=(query.heading_deg or 0) + 90))
    assert turned.reasons == ("heading 90 degrees off the expected, more than 30",)
    larger = localizer.locate(query, Prior(ground_sample_distance_m=(query.ground_sample_distance_m or 0) * 2))
    assert larger.reasons == ("scale 0.50 times the expected, more than 50% off",)


@pytest.mark.parametrize("pixel_m", [1e-5, 1e-3, 1e3])
def test_an_absurd_scale_does_no_harm(localizer: Localizer, world_queries: list[CutQuery], pixel_m: float) -> None:
    """The query would be matched as one pixel, or as large as may be."""
    assert localizer.locate(world_queries[0], Prior(ground_sample_distance_m=pixel_m)).status == "no_fix"


def test_large_queries_are_shrunk(reference: Reference, world_queries: list[CutQuery]) -> None:
    sizes = []

    class Looking(Counting):
        def features(self, image: Tensor) -> Features:
            sizes.append(tuple(image.shape[1:]))
            return SIFT.features(image)

    short = Localizer(reference, Looking(), PLAIN, search=Search(longest_side=200))
    check_found(short.locate(world_queries[2]), world_queries[2])
    # Known to have as many pixels as the map, it would be 320 wide times its scale.
    short.locate(world_queries[2], Prior(ground_sample_distance_m=0.1))
    assert sizes == [(150, 200), (80, 107)]
