"""Lines and rings around longitude 180: hand-made cases, lengths and areas kept, nothing beyond +-180."""

import math
import random
from itertools import pairwise

import pytest

from diffnav.geometry.geodesy import wrapped_deg
from diffnav.navigation.exports.antimeridian import cut_line, cut_ring, unwrapped_deg


def test_longitudes_are_unwrapped_next_to_another():
    assert unwrapped_deg(-179.5, 179) == pytest.approx(180.5)
    assert unwrapped_deg(179.5, -179) == pytest.approx(-180.5)
    assert unwrapped_deg(10.1, 11) == 10.1
    assert unwrapped_deg(370, 11) == pytest.approx(10)
    assert unwrapped_deg(-10, 720) == pytest.approx(710)


def test_a_line_far_from_the_antimeridian_stays_whole_with_longitude_first():
    assert cut_line([(50, 8), (51, 9), (50.5, 10)]) == [[(8, 50), (9, 51), (10, 50.5)]]


@pytest.mark.parametrize("side", [1, -1])
def test_a_line_across_is_cut_at_the_crossing(side):
    # From 179 to 183 degrees: a quarter of the way to the antimeridian, so of the latitude too.
    lines = cut_line([(10, side * 179), (14, side * -177)])
    assert lines == [[(side * 179, 10), (side * 180, 11)], [(side * -180, 11), (side * -177, 14)]]


def test_a_line_may_cross_back_and_touch():
    there_and_back = cut_line([(0, 179), (0, -179), (0, 179)])
    assert [[x for x, _ in line] for line in there_and_back] == [[179, 180], [-180, -179, -180], [180, 179]]
    # Ending and starting on the antimeridian itself leaves no line without length.
    assert cut_line([(0, 179), (1, 180)]) == [[(179, 0), (180, 1)]]
    assert [len(line) for line in cut_line([(1, 180), (0, 179)])] == [2]


def test_no_line_without_two_places():
    assert cut_line([]) == []
    assert cut_line([(1, 2)]) == []
    assert cut_line([(1, 2), (1, 2)]) == []


def test_random_lines_keep_their_length_and_stay_within_the_world():
    dice = random.Random(3)
    for _ in range(200):
        longitude, places = dice.uniform(170, 190), []
        steps = [dice.uniform(-8, 8) for _ in range(6)]
        for step in steps:
            longitude += step
            places.append((dice.uniform(-5, 5), float(wrapped_deg(longitude))))
        lines = cut_line(places)
        assert all(-180 <= x <= 180 for line in lines for x, _ in line)
        length = sum(abs(x - next_x) for line in lines for (x, _), (next_x, _) in pairwise(line))
        assert length == pytest.approx(sum(abs(step) for step in steps[1:]), abs=1e-9)


def area(ring):
    return sum(x * next_y - next_x * y for (x, y), (next_x, next_y) in pairwise(ring)) / 2


SQUARE = [(1, 10), (1, 12), (0, 12), (0, 10)]  # latitude, longitude, clockwise from the top left


def test_a_ring_is_closed_and_counter_clockwise_whatever_it_was():
    for corners in (SQUARE, SQUARE[::-1]):
        (ring,) = cut_ring(corners)
        assert ring[0] == ring[-1]
        assert len(ring) == 5
        assert area(ring) == pytest.approx(2)
        assert set(ring) == {(10, 1), (12, 1), (12, 0), (10, 0)}


@pytest.mark.parametrize("start", range(4))
def test_a_ring_across_becomes_two(start):
    corners = [(1, 179), (1, -177), (0, -177), (0, 179)]
    rings = cut_ring(corners[start:] + corners[:start])
    assert sorted(area(ring) for ring in rings) == pytest.approx([1, 3])
    west, east = sorted(rings, key=lambda ring: ring[0][0])
    assert {x for x, _ in west} == {-180, -177}
    assert {x for x, _ in east} == {179, 180}


def test_turned_rings_keep_their_area():
    dice = random.Random(5)
    for _ in range(100):
        middle, turn = dice.uniform(178, 182), dice.uniform(0, 2 * math.pi)
        corners = [
            (2 * math.sin(turn + k * math.pi / 2), float(wrapped_deg(middle + 2 * math.cos(turn + k * math.pi / 2))))
            for k in range(4)
        ]
        rings = cut_ring(corners)
        assert sum(area(ring) for ring in rings) == pytest.approx(8)
        assert all(-180 <= x <= 180 for ring in rings for x, _ in ring)
        assert all(area(ring) > 0 for ring in rings)


def test_no_ring_without_area():
    assert cut_ring([]) == []
    assert cut_ring([(0, 1), (1, 1)]) == []
    assert cut_ring([(0, 1), (1, 1), (2, 1)]) == []
