"""Why a homography cannot be a camera's view: each objection on a homography made to deserve it."""

import numpy as np
import pytest
import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.navigation.ground import Pose
from diffnav.navigation.plausibility import Plausibility, spread_of
from diffnav.navigation.prior import NOTHING, Prior

SIZE = (201, 301)
POSE = Pose(47.0, 8.0, 30.0, 0.3, ())
# About 100 m to the north of the pose.
NORTH = (47.0 + 100 / 111_195.08, 8.0)


def matrix(*rows: tuple[float, float, float]) -> Tensor:
    return torch.tensor(rows, dtype=torch.float64)


def turned(degrees: float, pixels: float = 1.0) -> Tensor:
    c, s = pixels * np.cos(np.radians(degrees)), pixels * np.sin(np.radians(degrees))
    return matrix((c, -s, 400), (s, c, 300), (0, 0, 1))


def tilted(x: float, y: float = 0.0) -> Tensor:
    """The divisor is 1 in the picture's middle and grows by so much to its edge."""
    return matrix((1, 0, 0), (0, 1, 0), (x / 150, y / 100, 1 - x - y))


def everywhere(count: int = 40) -> Tensor:
    """Inliers all over the picture."""
    return torch.rand(count, 2, generator=torch.Generator().manual_seed(0)) * torch.tensor([300.0, 200.0])


@pytest.mark.parametrize(
    "view",
    [turned(0), turned(77), turned(200, 0.3), turned(310, 4.0), 5 * turned(20), -0.3 * turned(20), tilted(0.15, 0.1)],
    ids=["as it is", "turned", "larger", "smaller", "times 5", "times -.3", "tilted"],
)
def test_a_cameras_view_has_nothing_against_it(view: Tensor) -> None:
    assert Plausibility().objections(view, SIZE, everywhere()) == []


def test_few_inliers() -> None:
    assert Plausibility(min_inliers=12).objections(turned(0), SIZE, everywhere(12)) == []
    assert Plausibility(min_inliers=12).objections(turned(0), SIZE, everywhere(11)) == ["11 inliers, fewer than 12"]


@pytest.mark.parametrize(
    "view",
    [
        matrix((-1, 0, 300), (0, 1, 0), (0, 0, 1)),
        matrix((1, 0, 0), (0, -2, 0), (0, 0, 1)),
        -1 * matrix((1, 0, 0), (0, -2, 0), (0, 0, 1)),
        # Rank 2: all of the picture on one line.
        matrix((1, 1, 0), (1, 1, 0), (0, 0, 1)),
        # Its right quarter lies beyond the horizon: there the picture would be seen from behind.
        tilted(-2.0),
        # The horizon cuts off one corner alone.
        tilted(-0.6, -0.6),
    ],
    ids=["left for right", "top for bottom", "times -1", "flat", "horizon", "a corner"],
)
def test_mirrored_folded_or_beyond_the_horizon(view: Tensor) -> None:
    assert Plausibility().objections(view, SIZE, everywhere()) == ["the picture would be mirrored or folded"]


def test_stretched() -> None:
    twice = matrix((2.5, 0, 0), (0, 1, 0), (0, 0, 1))
    assert Plausibility().objections(turned(50) @ twice, SIZE, everywhere()) == ["stretched 2.5 times, more than 2.0"]
    assert Plausibility(max_stretch=2.6).objections(twice, SIZE, everywhere()) == []


def test_a_strong_tilt_stretches_a_corner() -> None:
    """The divisor w at a corner divides across by w and along by w^2: seen from the far edge, w = .4, 2.5 : 1."""
    steep = tilted(-0.6)
    (objection,) = Plausibility().objections(steep, SIZE, everywhere())
    assert objection.startswith("stretched ")
    middle = matrix((1, 0, 0), (0, 1, 0), (0, 0, 1))
    assert Plausibility().objections(middle, SIZE, everywhere()) == []


@pytest.mark.parametrize(
    ("pixels", "message"),
    [(0.05, "0.05 ground pixels per pixel, outside of 0.1 to 10.0"), (12.0, "12 ground pixels per pixel, outside")],
)
def test_far_too_large_or_small(pixels: float, message: str) -> None:
    (objection,) = Plausibility().objections(turned(33, pixels), SIZE, everywhere())
    assert message in objection


def test_inliers_in_a_corner_or_on_a_line_say_little_of_the_rest() -> None:
    corner = 20 + everywhere() / 12
    (objection,) = Plausibility().objections(turned(0), SIZE, corner)
    assert objection == f"the inliers cover {spread_of(corner, SIZE):.1%} of the picture, less than 2.0%"
    line = torch.stack([torch.arange(50.0), 3 * torch.arange(50.0) + 1], 1)
    assert Plausibility().objections(turned(0), SIZE, line) == ["the inliers cover 0.0% of the picture, less than 2.0%"]
    assert Plausibility(min_spread=0.001).objections(turned(0), SIZE, corner) == []


def test_spread_is_the_area_of_an_ellipse() -> None:
    """Points on the axes at +-a, +-b: variances a^2 / 2, b^2 / 2, an ellipse of axes sqrt(2) a and sqrt(2) b."""
    points = torch.tensor([[30.0, 0], [-30, 0], [0, 10], [0, -10]]) + torch.tensor([140.0, 90])
    assert spread_of(points, SIZE) == pytest.approx(np.pi * 2 * 30 * 10 / (201 * 301), rel=1e-6)
    assert spread_of(points[:1], SIZE) == 0
    # Spread evenly over the picture: 4 pi / 12 of it.
    assert spread_of(everywhere(4000), (200, 300)) == pytest.approx(np.pi / 3, rel=0.05)


def test_several_things_may_be_wrong() -> None:
    view = matrix((0.09, 0, 0), (0, 0.03, 0), (0, 0, 1))
    objections = Plausibility().objections(view, SIZE, everywhere() / 50)
    assert [objection.split()[0] for objection in objections] == ["stretched", "0.052", "the"]


@pytest.mark.parametrize(
    ("prior", "sigma_m", "expected"),
    [
        (NOTHING, 14.9, []),
        (NOTHING, 15.1, ["uncertain by 15.1 m, more than 15.0 m"]),
        (Prior(NORTH, 101.0), 1.0, []),
        (Prior(NORTH, 99.0), 1.0, ["100 m from the expected place, more than 99 m"]),
        (Prior(NORTH, None), 1.0, []),
        (Prior(heading_deg=0.5), 1.0, []),
        (Prior(heading_deg=355.0), 1.0, ["heading 35 degrees off the expected, more than 30"]),
        (Prior(heading_deg=65.0), 1.0, ["heading 35 degrees off the expected, more than 30"]),
        (Prior(heading_deg=425.0), 1.0, ["heading 35 degrees off the expected, more than 30"]),
        (Prior(ground_sample_distance_m=0.21), 1.0, []),
        (Prior(ground_sample_distance_m=0.44), 1.0, []),
        (Prior(ground_sample_distance_m=0.15), 1.0, ["scale 2.00 times the expected, more than 50% off"]),
        (Prior(ground_sample_distance_m=0.6), 1.0, ["scale 0.50 times the expected, more than 50% off"]),
    ],
)
def test_what_a_prior_says_otherwise(prior: Prior, sigma_m: float, expected: list[str]) -> None:
    assert Plausibility().contradictions(POSE, sigma_m, prior) == expected


def test_all_contradictions_are_told() -> None:
    prior = Prior((48.0, 8.0), 10.0, heading_deg=200.0, ground_sample_distance_m=3.0)
    found = Plausibility().contradictions(POSE, 20.0, prior)
    assert [sentence.split()[0] for sentence in found] == ["uncertain", "111195", "heading", "scale"]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"min_inliers": 4}, "plausibility.min_inliers must be 5 or more, got 4: four fit anything"),
        ({"scale": (2.0, 1.0)}, r"plausibility.scale must be \[least, greatest\], above 0, got \[2.0, 1.0\]"),
        ({"scale": (0.0, 1.0)}, "plausibility.scale"),
    ],
)
def test_settings_out_of_range_are_named(settings: dict, message: str) -> None:
    with pytest.raises(UserError, match=message):
        Plausibility(**settings)
