"""LIME against its formulas in loops and dense algebra, and what holds for it whatever the picture."""

import math

import numpy as np
import pytest
import torch
from torch import Tensor

from diffnav.enhancers.lime import Lime, structure_weights
from diffnav.errors import UserError


def dark_picture(size: tuple[int, int] = (16, 18), batch: int = 1) -> Tensor:
    """Stripes and noise under a slope of light, 8 bit."""
    dice = torch.Generator().manual_seed(3)
    stripes = 0.5 + 0.5 * torch.sin(torch.arange(size[1]) / 2)
    colour = torch.tensor([0.3, 0.2, 0.1])[:, None, None] * torch.linspace(0.2, 1, size[0])[:, None] * stripes
    return (255 * (colour + 0.03 * torch.rand(batch, 3, *size, generator=dice))).round() / 255


def slow_weights(along: np.ndarray, sigma: float, epsilon: float) -> np.ndarray:
    """G*1 / (|G*D T0| + e) / (|D T0| + e), window by window."""
    radius = math.ceil(3 * sigma)
    window = [
        [math.exp(-(j * j + i * i) / 2 / sigma**2) for i in range(-radius, radius + 1)]
        for j in range(-radius, radius + 1)
    ]
    whole = sum(map(sum, window))
    found = np.zeros_like(along)
    for y in range(along.shape[0]):
        for x in range(along.shape[1]):
            ones = total = 0.0
            for j in range(-radius, radius + 1):
                for i in range(-radius, radius + 1):
                    if 0 <= y + j < along.shape[0] and 0 <= x + i < along.shape[1]:
                        share = window[j + radius][i + radius] / whole
                        ones += share
                        total += share * along[y + j, x + i]
            found[y, x] = ones / (abs(total) + epsilon) / (abs(along[y, x]) + epsilon)
    return found


def slow_lime(image: np.ndarray, alpha: float, sigma: float, epsilon: float, gamma: float) -> np.ndarray:
    """PAPER 9 for one picture (3, H, W) with a dense matrix in float64."""
    brightest = image.max(0)
    height, width = brightest.shape
    matrix = np.eye(height * width)
    along_x, along_y = np.diff(brightest, axis=1), np.diff(brightest, axis=0)
    for weights, step_y, step_x in (
        (slow_weights(along_x, sigma, epsilon), 0, 1),
        (slow_weights(along_y, sigma, epsilon), 1, 0),
    ):
        for y in range(weights.shape[0]):
            for x in range(weights.shape[1]):
                row = np.zeros(height * width)
                row[y * width + x], row[(y + step_y) * width + x + step_x] = -1, 1
                matrix += alpha * weights[y, x] * np.outer(row, row)
    light = np.linalg.solve(matrix, brightest.ravel()).reshape(height, width)
    return np.clip(image / np.maximum(light, epsilon) ** gamma, 0, 1)


@pytest.mark.parametrize("settings", [(0.15, 2.0, 1e-3, 0.8), (0.6, 1.0, 1e-2, 0.6)])
def test_the_result_is_that_of_the_formulas(settings: tuple[float, float, float, float]) -> None:
    image = dark_picture()
    expected = slow_lime(image[0].double().numpy(), *settings)
    assert 0.2 < expected.mean() < 0.9
    assert np.abs(Lime(*settings)(image)[0].numpy() - expected).max() < 1e-3


def test_weights_tell_texture_from_an_edge() -> None:
    """Equal steps, but in the texture they alternate: only the absolute value after smoothing can see that."""
    texture, edge = np.zeros((20, 21), np.float32), np.zeros((20, 21), np.float32)
    texture[:, ::2], texture[:, 1::2] = 0.1, -0.1
    edge[:, 10] = 0.1
    of_texture, of_edge = (structure_weights(along, 2.0, 1e-3)[10, 10] for along in (texture, edge))
    assert of_texture > 5 * of_edge


def test_the_illumination_lies_between_the_extremes_and_is_smoother() -> None:
    brightest = dark_picture((40, 57))[0].max(0).values.numpy()
    light = Lime().illumination(brightest)
    assert light.min() >= brightest.min() - 1e-5
    assert light.max() <= brightest.max() + 1e-5
    assert light.mean() == pytest.approx(brightest.mean(), rel=1e-3)
    assert np.abs(np.diff(light)).mean() < 0.3 * np.abs(np.diff(brightest)).mean()


def test_a_flat_picture_keeps_a_fifth_root_of_its_light() -> None:
    """T = S, so S / S^.8 = S^.2: the same everywhere, monotonic; black stays black."""
    for level in (0.0, 0.02, 0.3, 1.0):
        result = Lime()(torch.full((1, 3, 19, 30), level))
        assert torch.allclose(result, torch.tensor(level**0.2), atol=1e-4)


def test_a_dark_picture_gets_brighter_and_keeps_its_colours() -> None:
    image = dark_picture((30, 44))
    result = Lime()(image)
    assert (result >= image - 1e-6).all()
    inside = result.max(1).values[0] < 1
    ratios = [one[0] / one[0].max(0).values for one in (image, result)]
    assert torch.allclose(ratios[0][:, inside], ratios[1][:, inside], atol=1e-5)


@pytest.mark.parametrize("size", [(16, 16), (17, 33), (41, 16)])
def test_odd_sizes_and_a_batch_as_its_pictures(size: tuple[int, int]) -> None:
    image = dark_picture(size, batch=2)
    result = Lime()(image)
    assert result.shape == image.shape
    assert torch.equal(result, torch.cat([Lime()(image[:1]), Lime()(image[1:])]))


def test_hard_edges_and_single_lights_stay_finite() -> None:
    image = torch.zeros(2, 3, 20, 30)
    image[0, ..., 11:] = 1
    image[1, :, 7, 9] = 1
    result = Lime()(image)
    assert torch.isfinite(result).all()
    assert 0 <= result.min() <= result.max() <= 1


@pytest.mark.parametrize(
    "arguments",
    [{"alpha": -1}, {"sigma": 0}, {"epsilon": 0}, {"gamma": 0}, {"gamma": 1.5}, {"tolerance": 0}, {"tolerance": 1}],
)
def test_a_setting_that_lime_cannot_use_is_one_sentence(arguments: dict) -> None:
    with pytest.raises(UserError, match="lime needs"):
        Lime(**arguments)
