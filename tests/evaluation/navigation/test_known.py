import math
from pathlib import Path

import pytest
from navigation_stubs import DEGREE_M, stub_map

from diffnav.data.queries.query import Query
from diffnav.errors import UserError
from diffnav.evaluation.navigation.known import Known
from diffnav.navigation.prior import NOTHING

PLACE = (60.0, 25.0)


def query(name: str = "q", **facts) -> Query:
    return Query(name, Path("q.png"), **({"truth": PLACE} | facts))


def metres_east_and_north(origin: tuple[float, float], place: tuple[float, float]) -> tuple[float, float]:
    """On a plane: good to millimetres within a hundred metres."""
    return (
        (place[1] - origin[1]) * DEGREE_M * math.cos(math.radians(origin[0])),
        (place[0] - origin[0]) * DEGREE_M,
    )


@pytest.fixture(scope="module")
def offsets() -> list[tuple[float, float]]:
    """Of 600 circles' middles from the truth."""
    known = Known(radius_m=100)
    return [metres_east_and_north(PLACE, known.prior(query(f"q{k}"), 0).place) for k in range(600)]


def test_the_truth_always_lies_in_the_circle(offsets: list[tuple[float, float]]):
    assert max(math.hypot(*offset) for offset in offsets) <= 100 + 1e-3


def test_the_middles_lie_evenly(offsets: list[tuple[float, float]]):
    # Of an even spread a quarter lies within half the radius, as many in each quadrant: binomial, +- 4 deviations.
    inner = sum(math.hypot(*offset) < 50 for offset in offsets)
    assert abs(inner - 150) < 4 * math.sqrt(600 * 0.25 * 0.75)
    for east in (-1, 1):
        for north in (-1, 1):
            quadrant = sum(x * east > 0 and y * north > 0 for x, y in offsets)
            assert abs(quadrant - 150) < 4 * math.sqrt(600 * 0.25 * 0.75)


def test_each_depends_on_the_seed_and_its_name_alone():
    known, names = Known(radius_m=50), ["a", "b", "c"]
    there = {name: known.prior(query(name), 3) for name in names}
    assert {name: known.prior(query(name), 3) for name in reversed(names)} == there
    assert len({prior.place for prior in there.values()}) == 3
    assert known.prior(query("a"), 4) != there["a"]
    assert known.prior(query("a", heading_deg=3.0, flight="f"), 3) == there["a"]


def test_nothing_is_told_unless_asked_for():
    logged = query(heading_deg=359.0, ground_sample_distance_m=0.2)
    assert Known().prior(logged, 0) is NOTHING
    assert Known(radius_m=5).prior(query(truth=None), 0) is NOTHING
    assert Known(heading=True, scale=True).prior(query(), 0) is NOTHING
    told = Known(heading=True, heading_offset_deg=2.0, scale=True).prior(logged, 0)
    assert (told.place, told.radius_m, told.heading_deg) == (None, None, 1.0)
    assert told.ground_sample_distance_m == 0.2
    # Given for all, but not asked for.
    assert Known(ground_sample_distance_m=0.3).prior(logged, 0) is NOTHING
    assert Known(ground_sample_distance_m=0.3, scale=True).prior(query(), 0).ground_sample_distance_m == 0.3


def test_a_stated_place_is_that_of_all():
    known = Known(radius_m=300, place=[47, 8])
    for one in (query("a"), query("b", truth=None), query("c", truth=None, on_map=False)):
        assert (known.prior(one, 0).place, known.prior(one, 0).radius_m) == ((47.0, 8.0), 300)


def test_a_picture_off_the_maps_is_told_a_place_on_them():
    near, far = stub_map("near"), stub_map("far", (1000, 2000))
    known, corners = Known(radius_m=10), {}
    for k in range(60):
        place = known.prior(query(f"q{k}", truth=None, on_map=False), 0, [near, far]).place
        x, y = far.georeference.pixels(place)
        assert -0.5 <= x <= 1999.5
        assert -0.5 <= y <= 999.5
        corners[x > 80 or y > 60] = place
    # Some on each map.
    assert set(corners) == {True, False}
    # Its own truth, far from every map, would make it easy.
    told = known.prior(query(on_map=False), 0, [near]).place
    assert abs(told[0] - 47) < 0.01
    assert known.prior(query(on_map=False), 0) is NOTHING


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"radius_m": 0}, "prior.radius_m must be above 0 or null, got 0"),
        ({"ground_sample_distance_m": -1.0}, "prior.ground_sample_distance_m must be above 0"),
        ({"place": [47, 8]}, "prior.place needs prior.radius_m"),
        ({"place": [100, 8], "radius_m": 5}, r"prior.place must be \[latitude,longitude\] in degrees, got \[100, 8\]"),
        ({"place": "Bern", "radius_m": 5}, "prior.place must be"),
        ({"place": [47], "radius_m": 5}, "prior.place must be"),
    ],
)
def test_mistakes(settings: dict, message: str):
    with pytest.raises(UserError, match=message):
        Known(**settings)
