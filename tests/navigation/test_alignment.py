"""A query turned north-up and scaled: its points arrive where the homography says."""

import math

import pytest
import torch
from torch import Tensor

from diffnav.geometry.homography import apply_homography
from diffnav.matching.matches import Features, Matches
from diffnav.navigation.alignment import align

SIZE = (150, 220)


def dot(x: float, y: float, size: tuple[int, int] = SIZE, width: float = 4.0) -> Tensor:
    """A bright spot in the dark, (3, h, w)."""
    row, column = torch.meshgrid(*(torch.arange(side, dtype=torch.float64) for side in size), indexing="ij")
    return torch.exp(-((column - x) ** 2 + (row - y) ** 2) / (2 * width**2)).float().expand(3, -1, -1)


def centre(image: Tensor, beside: list[float]) -> list[float]:
    """Where the brightness of a picture lies in the mean, beside a point: corners show a mirrored dot."""
    grey = image.double().mean(0)
    y, x = torch.meshgrid(*(torch.arange(side, dtype=torch.float64) for side in grey.shape), indexing="ij")
    grey = grey * ((x - beside[0]) ** 2 + (y - beside[1]) ** 2 < 35**2)
    return [float((grey * axis).sum() / grey.sum()) for axis in (x, y)]


@pytest.mark.parametrize("scale", [1.0, 0.43, 0.71, 1.6])
@pytest.mark.parametrize("heading_deg", [0, 30, 90, 135, 180, 270, -45, 397.5])
def test_a_dot_arrives_where_the_homography_says(heading_deg: float, scale: float) -> None:
    point = torch.tensor([[80.3, 61.8]], dtype=torch.float64)
    aligned = align(dot(80.3, 61.8), scale, heading_deg)
    expected = apply_homography(aligned.H_query_aligned, point)[0].tolist()
    assert centre(aligned.image, expected) == pytest.approx(expected, abs=0.05)
    assert aligned.query_size == SIZE
    size = torch.tensor([aligned.image.shape[2] - 1.0, aligned.image.shape[1] - 1]).double()
    corners = torch.tensor([[0.0, 0], [219, 0], [219, 149], [0, 149]])
    there = apply_homography(aligned.H_query_aligned, corners)
    # Of the resized picture the outermost centres move inwards by half of what a pixel shrinks.
    slack = abs(1 - scale) + 1e-9
    assert (there >= -slack).all()
    assert (there <= size + slack).all()
    assert (there.amin(0) < 1 + slack).all()
    assert (there.amax(0) > size - 2 - slack).all()


@pytest.mark.parametrize(
    ("heading_deg", "east", "south"), [(0, 0, -1), (90, 1, 0), (180, 0, 1), (270, -1, 0), (45, 0.7071, -0.7071)]
)
def test_north_is_up(heading_deg: float, east: float, south: float) -> None:
    """What the picture's top shows lies towards its heading, seen from its middle."""
    image = align(dot(109.5, 34.5), 1.0, heading_deg).image
    expected = [(image.shape[2] - 1) / 2 + 40 * east, (image.shape[1] - 1) / 2 + 40 * south]
    # The picture's middle is at most half a pixel off its corners' middle.
    assert centre(image, expected) == pytest.approx(expected, abs=0.6)


def test_without_scale_and_heading_nothing_changes() -> None:
    image = dot(10, 20)
    for heading_deg in (0.0, 360.0, -720.0):
        aligned = align(image, 1.0, heading_deg)
        assert aligned.image is image
        assert torch.equal(aligned.H_query_aligned, torch.eye(3, dtype=torch.float64))
        assert not aligned.turned


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_quarter_turns_only_exchange_pixels(turns: int) -> None:
    image = torch.rand(3, *SIZE, generator=torch.Generator().manual_seed(1))
    aligned = align(image, 1.0, 90.0 * turns)
    expected = image.rot90(-turns, (1, 2))
    assert aligned.image.shape == expected.shape
    # The mean of four samples of each pixel smooths, and moves nothing: less so than a pixel's shift.
    off = (aligned.image - expected).abs().mean()
    assert off < 0.6 * (expected[..., 1:] - expected[..., :-1]).abs().mean()


class Lattice:
    """A keypoint at every tenth pixel and just outside of the picture's edges."""

    name, settings = "lattice", {}

    def features(self, image: Tensor) -> Features:
        height, width = image.shape[1:]
        y, x = torch.meshgrid(
            *(
                torch.cat([torch.tensor([-0.4]), torch.arange(0, n, 10.0), torch.tensor([n - 0.6])])
                for n in (height, width)
            ),
            indexing="ij",
        )
        points = torch.stack([x.flatten(), y.flatten()], 1)
        return Features(points, points * 2, points[:, 0], (height, width))

    def match(self, a: Features, b: Features) -> Matches:
        raise NotImplementedError


def test_an_upright_picture_keeps_all_features() -> None:
    for scale in (1.0, 0.5, 1.7):
        aligned = align(dot(10, 20), scale)
        found, own = aligned.features(Lattice()), Lattice().features(aligned.image)
        assert torch.equal(found.keypoints, own.keypoints)
        assert found.size == own.size


@pytest.mark.parametrize("scale", [1.0, 0.5])
@pytest.mark.parametrize("heading_deg", [30, 120, 200])
def test_a_turned_picture_keeps_those_that_show_the_query(heading_deg: float, scale: float) -> None:
    """Four pixels inside of the turned picture's edges: by each edge's distance, computed from its turned corners."""
    aligned = align(dot(10, 20), scale, heading_deg)
    found, own = aligned.features(Lattice()), Lattice().features(aligned.image)
    assert found.size == own.size == aligned.image.shape[1:]
    corners = apply_homography(
        aligned.H_query_aligned, torch.tensor([[0.0, 0], [219, 0], [219, 149], [0, 149]])
    ).tolist()
    kept = {tuple(point) for point in found.keypoints.tolist()}
    for x, y in own.keypoints.tolist():
        distances = []
        for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1], strict=True):
            inwards = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
            distances.append(inwards / math.hypot(x1 - x0, y1 - y0))
        if abs(min(distances) - 4) > 0.05:
            assert ((x, y) in kept) == (min(distances) > 4)
    assert 20 < len(found) < len(own)
    assert torch.equal(found.descriptors, found.keypoints * 2)
    assert torch.equal(found.scores, found.keypoints[:, 0])


def test_next_to_nothing_is_left_of_a_tiny_scale() -> None:
    aligned = align(dot(10, 20), 1e-4, 20.0)
    assert min(aligned.image.shape[1:]) >= 1
    assert len(aligned.features(Lattice())) == 0
