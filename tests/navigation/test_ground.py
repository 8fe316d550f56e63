"""The ground around a place as a picture, and how a picture lies on it."""

import math

import numpy as np
import pytest
import torch
from made_maps import DEGREE_M, ORIGIN, metres_from

from diffnav.navigation.ground import Ground, pose_of


def similarity(heading_deg: float, pixels: float, middle: tuple[float, float], size: tuple[int, int]) -> torch.Tensor:
    """A picture on the ground: its top points to the heading, its pixels measure so many of the ground's."""
    up = math.sin(math.radians(heading_deg)), -math.cos(math.radians(heading_deg))
    right = -up[1], up[0]
    x, y = (size[1] - 1) / 2, (size[0] - 1) / 2
    rows = [[pixels * right[axis], -pixels * up[axis]] for axis in (0, 1)]
    shift = [middle[axis] - rows[axis][0] * x - rows[axis][1] * y for axis in (0, 1)]
    return torch.tensor([[*rows[0], shift[0]], [*rows[1], shift[1]], [0, 0, 1]], dtype=torch.float64)


def test_x_points_east_and_y_south() -> None:
    ground = Ground(ORIGIN, 0.5)
    points = np.array([[0.0, 0], [200, 0], [0, 200], [-200, 0], [0, -200], [30, -40]])
    for place, (x, y) in zip(ground.latlon(points), points, strict=True):
        assert metres_from(ORIGIN, place) == pytest.approx((0.5 * x, -0.5 * y), abs=1e-3)
    assert ground.points(ground.latlon(points)) == pytest.approx(points, abs=1e-7)


def test_over_the_antimeridian() -> None:
    ground = Ground((10.0, 179.999), 1.0)
    (place,) = ground.latlon(np.array([[300.0, 0.0]]))
    assert place[1] == pytest.approx(179.999 + 300 / (DEGREE_M * math.cos(math.radians(10))) - 360, abs=1e-8)
    assert ground.points(place[None]) == pytest.approx(np.array([[300.0, 0.0]]), abs=1e-6)


@pytest.mark.parametrize("heading_deg", [0, 37, 90, 180, 270, 359.5])
def test_the_pose_of_a_similarity(heading_deg: float) -> None:
    """A picture of 101 x 201 whose middle lies 200 m east and 150 m south of the origin, at .3 m a pixel."""
    size = (101, 201)
    H = similarity(heading_deg, 0.3 / 0.5, (400, 300), size)
    pose = pose_of(H, size, Ground(ORIGIN, 0.5))
    assert metres_from(ORIGIN, (pose.latitude, pose.longitude)) == pytest.approx((200, -150), abs=0.01)
    # Meridians meet: 200 m east of the origin north is turned by .002 degrees.
    assert pose.heading_deg == pytest.approx(heading_deg, abs=0.004)
    assert pose.ground_sample_distance_m == pytest.approx(0.3, rel=1e-6)
    ahead = math.sin(math.radians(heading_deg)), math.cos(math.radians(heading_deg))
    right = ahead[1], -ahead[0]
    for place, (x, y) in zip(pose.footprint, ((-1, 1), (1, 1), (1, -1), (-1, -1)), strict=True):
        east, north = (200 * 0.3 * x * right[axis] / 2 + 100 * 0.3 * y * ahead[axis] / 2 for axis in (0, 1))
        assert metres_from(ORIGIN, place) == pytest.approx((200 + east, -150 + north), abs=0.01)


def test_the_scale_of_h_does_not_matter() -> None:
    size = (100, 150)
    H = similarity(200, 0.7, (50, 60), size)
    for factor in (3.0, -0.2):
        pose = pose_of(factor * H, size, Ground(ORIGIN, 0.5))
        assert pose.heading_deg == pytest.approx(200, abs=0.01)
        assert pose.ground_sample_distance_m == pytest.approx(0.35, rel=1e-6)


def test_the_scale_is_the_root_of_the_area() -> None:
    H = torch.tensor([[2.0, 0, 0], [0, 0.5, 0], [0, 0, 1]])
    assert pose_of(H, (11, 11), Ground(ORIGIN, 0.4)).ground_sample_distance_m == pytest.approx(0.4, rel=1e-6)


def test_headings_are_those_of_the_place_not_of_the_origin() -> None:
    """20 km east of the origin at 70 degrees north, east is turned by distance / radius x tan(latitude)."""
    size = (101, 101)
    pose = pose_of(similarity(0, 1.0, (20_000, 0), size), size, Ground((70.0, 20.0), 1.0))
    turned = math.degrees(20_000 / 6_371_008.8 * math.tan(math.radians(70)))
    assert turned > 0.49
    assert pose.heading_deg == pytest.approx(turned, abs=0.003)


def test_a_tilted_picture_is_measured_in_its_middle() -> None:
    """With a divisor 1 + .001 y that is 1 at the middle the top's direction and scale stay."""
    size = (201, 201)
    flat = similarity(90, 1.0, (100, 100), size)
    about = torch.tensor([[1, 0, -100], [0, 1, -100], [0, 0, 1]], dtype=torch.float64)
    H = flat @ torch.linalg.inv(about) @ torch.tensor([[1, 0, 0], [0, 1, 0], [0, 0.001, 1]]).double() @ about
    pose = pose_of(H, size, Ground(ORIGIN, 0.5))
    assert pose.heading_deg == pytest.approx(90, abs=0.01)
    assert pose.ground_sample_distance_m == pytest.approx(0.5, rel=1e-4)
    assert metres_from(ORIGIN, (pose.latitude, pose.longitude)) == pytest.approx((50, -50), abs=0.01)
    # What is beyond the middle, seen at a divisor of .9, is larger: the footprint's upper edge is longer.
    upper = math.dist(*(metres_from(ORIGIN, pose.footprint[k]) for k in (0, 1)))
    lower = math.dist(*(metres_from(ORIGIN, pose.footprint[k]) for k in (2, 3)))
    assert upper == pytest.approx(100 / 0.9, rel=1e-3)
    assert lower == pytest.approx(100 / 1.1, rel=1e-3)
