"""The embedded street: where points appear, what two cameras share, what a drive changes."""

import itertools
import pickle

import cv2
import numpy as np
import pytest
import torch

from diffnav.data.driving.driving_set import frames_apart, metres_apart
from diffnav.data.driving.scenes_drive import scenes_drive
from diffnav.data.driving.street.camera import StreetCamera
from diffnav.data.driving.street.street import render
from diffnav.errors import UserError
from diffnav.images import to_uint8
from diffnav.matching.sift import Sift

SIZE, FOCAL_PX = (176, 320), 256.0
HEIGHT_M, BASELINE_M = 1.65, 0.5
LEFT = StreetCamera((1.0, -HEIGHT_M, 20.0), FOCAL_PX, SIZE)
RIGHT = StreetCamera((1.0 + BASELINE_M, -HEIGHT_M, 20.0), FOCAL_PX, SIZE)
AHEAD = StreetCamera((1.2, -HEIGHT_M, 23.0), FOCAL_PX, SIZE)


@pytest.fixture(scope="module")
def views() -> list[tuple[torch.Tensor, torch.Tensor]]:
    return [render(0, camera) for camera in (LEFT, RIGHT)]


def sample(image: torch.Tensor, x: torch.Tensor, y: torch.Tensor) -> torch.Tensor:
    """(3, N) linear between the four pixels around."""
    left, top = (p.floor().long().clamp(max=side - 2) for p, side in ((x, SIZE[1]), (y, SIZE[0])))
    right, down = (x - left).float(), (y - top).float()
    above = image[:, top, left] * (1 - right) + image[:, top, left + 1] * right
    below = image[:, top + 1, left] * (1 - right) + image[:, top + 1, left + 1] * right
    return above * (1 - down) + below * down


def test_projection_by_hand() -> None:
    camera = StreetCamera((1.0, -1.5, 2.0), 100.0, (51, 101))
    # 10 m ahead, 3 m to the right, on the road: x = 50 + 100 * 2 / 8, y = 25 + 100 * 1.5 / 8.
    assert camera.project(np.array([[3.0, 0.0, 10.0], [1.0, -1.5, 3.0]])).tolist() == [[75.0, 43.75], [50.0, 25.0]]


@pytest.mark.parametrize("camera", [LEFT, RIGHT], ids=["left", "right"])
@pytest.mark.parametrize("dash", [3, 4])
def test_a_dash_of_the_centre_line_lies_where_it_should(camera: StreetCamera, dash: int, views) -> None:
    """Dashes run from 9 k to 9 k + 3 m at x = 0, 15 cm wide: their middles and edges projected by hand."""
    image = views[camera is RIGHT][0].mean(0)
    z = 9.0 * dash + 1.5 - 20.0
    row = round((SIZE[0] - 1) / 2 + FOCAL_PX * HEIGHT_M / z)
    # The row that is painted lies at its own depth.
    z = FOCAL_PX * HEIGHT_M / (row - (SIZE[0] - 1) / 2)
    assert 9 * dash < z + 20 < 9 * dash + 3
    middle = (SIZE[1] - 1) / 2 + FOCAL_PX * (0.0 - camera.position_m[0]) / z
    half = FOCAL_PX * 0.075 / z
    around = np.arange(round(middle) - 12, round(middle) + 13)
    bright = image[row, around].numpy() - np.median(image[row, around])
    weight = np.clip(bright, 0.1, None) - 0.1
    assert (weight * around).sum() / weight.sum() == pytest.approx(middle, abs=0.15)
    # Its area is its width times its brightness.
    assert bright[np.abs(around - middle) < half + 1.5].sum() / bright.max() == pytest.approx(2 * half, rel=0.35)


def test_the_road_moves_between_the_cameras_as_a_plane_does(views) -> None:
    """Disparity b (y - cy) / h on the road, by the plane's equation; where the depth says that it is the road."""
    (left, depth_left), (right, depth_right) = views
    y, x = torch.meshgrid(torch.arange(110, SIZE[0]), torch.arange(60, SIZE[1] - 2), indexing="ij")
    below = y - (SIZE[0] - 1) / 2
    there = x - BASELINE_M * below / HEIGHT_M
    depth = FOCAL_PX * HEIGHT_M / below
    road = (depth_left[y, x] - depth).abs() < 0.01
    road &= (there >= 0) & ((depth_right[y, there.clamp(min=0).long()] - depth).abs() < 0.01)
    assert road.float().mean() > 0.4
    difference = (sample(left, x[road].double(), y[road]) - sample(right, there[road], y[road])).abs().mean(0)
    shifted = (sample(left, x[road].double() - 2, y[road]) - sample(right, there[road], y[road])).abs().mean(0)
    assert difference.mean() < 0.012
    assert shifted.mean() > 3 * difference.mean()


@pytest.mark.parametrize("other", [RIGHT, AHEAD], ids=["right", "ahead"])
def test_a_point_has_one_colour_from_wherever_it_is_seen(other: StreetCamera, views) -> None:
    """Points of the left picture, by its depth, looked up in another; what is hidden there is left out."""
    (left, depth_left), (image, depth_other) = views[0], render(0, other)
    y, x = torch.meshgrid(torch.arange(SIZE[0]), torch.arange(SIZE[1]), indexing="ij")
    z = depth_left.double()
    across, down = (x - (SIZE[1] - 1) / 2) * z / FOCAL_PX, (y - (SIZE[0] - 1) / 2) * z / FOCAL_PX
    right, _, ahead = (a - b for a, b in zip(other.position_m, LEFT.position_m, strict=True))
    z = z - ahead
    u = (SIZE[1] - 1) / 2 + FOCAL_PX * (across - right) / z
    v = (SIZE[0] - 1) / 2 + FOCAL_PX * down / z
    seen = torch.isfinite(z) & (z > 1) & (u >= 1) & (u <= SIZE[1] - 2) & (v >= 1) & (v <= SIZE[0] - 2)
    row, column = (p.nan_to_num().clamp(0, side - 1) for p, side in ((v, SIZE[0]), (u, SIZE[1])))
    for above, beside in itertools.product((torch.floor, torch.ceil), repeat=2):
        seen &= (depth_other[above(row).long(), beside(column).long()] - z).abs() < 0.03 * z
    difference = torch.full(SIZE, torch.nan)
    difference[seen] = (left[:, seen] - sample(image, u[seen], v[seen])).abs().mean(0)
    x_world = across + LEFT.position_m[0]
    surfaces = {
        "road": down - HEIGHT_M, "left houses": x_world + 9, "right houses": x_world - 9,
        "left cars": x_world + 4.05, "right cars": x_world - 4.05,
    }  # fmt: skip
    for name, away in surfaces.items():
        there = difference[seen & (away.abs() < 0.01)]
        assert len(there) > 1000, name
        assert there.median() < 0.014, name
        assert (there < 0.1).float().mean() > 0.93, name


def test_matches_between_the_cameras_keep_their_row(views) -> None:
    """A rectified pair: equal rows, and disparities above 0 and below that of the nearest road."""
    left, right = (image for image, _ in views)
    sift = Sift()
    matches = sift.match(sift.features(left), sift.features(right))
    assert len(matches) > 80
    dx, dy = (matches.points_a - matches.points_b).T
    good = (dy.abs() < 1) & (dx > -0.5) & (dx < BASELINE_M * SIZE[0] / 2 / HEIGHT_M + 1)
    assert good.float().mean() > 0.9


def test_a_street_is_its_seed_and_its_place() -> None:
    again, _ = render(0, LEFT)
    assert torch.equal(again, render(0, LEFT)[0])
    small = StreetCamera(LEFT.position_m, FOCAL_PX, (88, 160))
    # A smaller picture with the same focal length is the middle of the larger one.
    assert torch.allclose(render(0, small)[0], again[:, 44:132, 80:240], atol=1e-5)
    assert (render(1, LEFT)[0] - again).abs().mean() > 0.05
    assert 0 <= again.min() < 0.2 < 0.8 < again.max() <= 1


def test_the_horizon_of_odd_sizes_is_painted() -> None:
    image, _ = render(0, StreetCamera((1.6, -HEIGHT_M, 5.0), 60.0, (51, 81)))
    assert image[:, 25].amin() > 0.03
    assert image[:, :, 40].amin() > 0.03


class TestDrive:
    def test_frames_of_a_drive(self) -> None:
        drive = scenes_drive(5, seed=3, size=(48, 64), step_m=2.0, baseline_m=0.4)
        assert drive.counts == {"street_3": 5}
        assert drive.consecutive
        assert drive.truth == [0, 1, 2, 3, 4]
        assert [q.position_m[2] for q in drive.queries] == [0.0, 2.0, 4.0, 6.0, 8.0]
        assert metres_apart(drive.queries[4], drive.references[4]) == pytest.approx(0.4)
        assert frames_apart(drive.queries[4], drive.references[2]) == 2
        assert len({q.name for q in [*drive.queries, *drive.references]}) == 10

    def test_pictures_travel_to_workers_and_are_8_bit(self) -> None:
        few, many = scenes_drive(2, size=(48, 64)), scenes_drive(3, size=(48, 64))
        assert [q.name for q in few.queries] == [q.name for q in many.queries[:2]]
        first = few.queries[1].read()
        assert torch.equal(first, pickle.loads(pickle.dumps(many.queries[1])).read())
        assert torch.equal((first * 255).round() / 255, first)
        assert first.shape == (3, 48, 64)
        assert not torch.equal(first, few.queries[0].read())
        assert not torch.equal(first, few.references[1].read())

    def test_there_is_enough_to_match(self) -> None:
        for frame in scenes_drive(1, seed=5).queries:
            image = to_uint8(frame.read())
            assert image.shape == (352, 640, 3)
            # With OpenCV's own threshold of 20 grey levels, which faint noise does not pass.
            assert len(cv2.ORB.create(500).detect(image)) == 500

    def test_mistakes_are_one_sentence(self) -> None:
        with pytest.raises(UserError, match=r"data\.count must be 1 or more, got 0"):
            scenes_drive(0)
        with pytest.raises(UserError, match=r"data\.step_m must be above 0"):
            scenes_drive(2, step_m=0)
        with pytest.raises(UserError, match=r"data\.baseline_m must be above 0 and at most 2, got 9"):
            scenes_drive(2, baseline_m=9)
        with pytest.raises(UserError, match="size of 1 x 1"):
            scenes_drive(2, size=(0, 64))
