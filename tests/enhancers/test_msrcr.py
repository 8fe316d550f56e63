"""MSRCR against its formulas with direct convolution, its wide Gaussians, and what holds whatever the picture."""

import math

import cv2
import numpy as np
import pytest
import torch
from torch import Tensor

from diffnav.enhancers.msrcr import Msrcr, gaussian_blur
from diffnav.errors import UserError


def dark_picture(size: tuple[int, int] = (16, 18), batch: int = 1) -> Tensor:
    """Waves of colour, dark on one side, with noise, 8 bit."""
    dice = torch.Generator().manual_seed(5)
    y, x = torch.meshgrid(torch.linspace(0, 1, size[0]), torch.linspace(0, 1, size[1]), indexing="ij")
    waves = torch.stack([x * (0.4 + 0.3 * torch.sin(6 * y + 2 * k + 4 * x)) for k in range(3)])
    return (255 * (waves + 0.1 * torch.rand(batch, 3, *size, generator=dice))).round() / 255


def mirrored(place: int, length: int) -> int:
    """The pixel that an endlessly mirrored line shows at a place: ... 1 0 0 1 2 ... n-1 n-1 n-2 ..."""
    place %= 2 * length
    return place if place < length else 2 * length - 1 - place


def direct_matrix(length: int, sigma: float) -> np.ndarray:
    """Convolution of a mirrored line with a sampled Gaussian of 6 sigma each way, tap by tap."""
    radius = math.ceil(6 * sigma)
    taps = [math.exp(-((i / sigma) ** 2) / 2) for i in range(-radius, radius + 1)]
    whole = sum(taps)
    matrix = np.zeros((length, length))
    for x in range(length):
        for i, tap in enumerate(taps):
            matrix[x, mirrored(x + i - radius, length)] += tap / whole
    return matrix


def direct_blur(image: np.ndarray, sigma: float) -> np.ndarray:
    return direct_matrix(image.shape[0], sigma) @ image @ direct_matrix(image.shape[1], sigma).T


def slow_restored(image: np.ndarray, sigmas: tuple[float, ...]) -> np.ndarray:
    """PAPER 9 for one picture (3, H, W), pixel by pixel in float64."""
    levels = 255 * image + 1
    surrounds = [[direct_blur(channel, sigma) for sigma in sigmas] for channel in levels]
    found = np.zeros_like(levels)
    for c in range(3):
        for y in range(image.shape[1]):
            for x in range(image.shape[2]):
                value = levels[c, y, x]
                retinex = sum((math.log(value) - math.log(one[y, x])) / len(sigmas) for one in surrounds[c])
                restoration = 46 * (math.log(125 * value) - math.log(levels[:, y, x].sum()))
                found[c, y, x] = retinex * restoration
    return found


def test_stretched_result_of_the_formulas() -> None:
    image = dark_picture((24, 30))
    sigmas = (2.0, 5.0, 40.0)
    expected = slow_restored(image[0].double().numpy(), sigmas)
    for channel in expected:
        ordered = np.sort(channel.ravel())
        # 1 % of 720 pixels: seven at either end.
        low, high = ordered[7], ordered[-8]
        channel -= low
        channel /= high - low
    result = Msrcr(sigmas)(image)[0].numpy()
    assert np.abs(result - expected.clip(0, 1)).max() < 1e-3
    assert (result == 0).sum(axis=(1, 2)).tolist() == [8, 8, 8]
    assert (result == 1).sum(axis=(1, 2)).tolist() == [8, 8, 8]


def test_result_of_the_formulas_with_gain_and_offset() -> None:
    image = dark_picture((24, 30))
    value = slow_restored(image[0].double().numpy(), (2.0, 5.0, 40.0))
    result = Msrcr((2.0, 5.0, 40.0), finish="gain", gain=3.0, offset=20.0)(image)[0].numpy()
    expected = (3 * (value + 20) / 255).clip(0, 1)
    assert ((expected > 0) & (expected < 1)).mean() > 0.1
    assert np.abs(result - expected).max() < 1e-3


@pytest.mark.parametrize(("sigma", "error"), [(1.0, 0.05), (3.0, 2e-3), (15.0, 2e-3), (80.0, 2e-3), (250.0, 2e-3)])
def test_a_wide_gaussian_is_the_direct_convolution(sigma: float, error: float) -> None:
    """Of 255 levels, and also where the Gaussian is much wider than the picture; at sigma 1 a sampled kernel is
    itself no Gaussian any more."""
    image = 255 * dark_picture((40, 61))[0]
    expected = np.stack([direct_blur(channel, sigma) for channel in image.double().numpy()])
    assert np.abs(gaussian_blur(image, sigma).numpy() - expected).max() < error


def test_a_wide_gaussian_is_opencvs() -> None:
    """At full size, sigma 80; OpenCV cuts its kernel at 4 sigma, which alone moves it by some .005 of 255 levels."""
    channel = 255 * dark_picture((400, 600))[0, 0].numpy()
    expected = cv2.GaussianBlur(channel, (0, 0), 80, borderType=cv2.BORDER_REFLECT)
    assert np.abs(gaussian_blur(torch.from_numpy(channel), 80.0).numpy() - expected).max() < 0.02


@pytest.mark.parametrize("finish", ["stretch", "gain"])
def test_a_flat_picture_stays_flat(finish: str) -> None:
    for colour in ((0.0, 0.0, 0.0), (0.1, 0.3, 0.2), (1.0, 1.0, 1.0)):
        image = torch.tensor(colour)[None, :, None, None].expand(1, 3, 17, 30)
        result = Msrcr(finish=finish)(image)
        assert torch.isfinite(result).all()
        assert (result.amax((2, 3)) - result.amin((2, 3))).max() < 1e-4
        if finish == "stretch":
            assert torch.allclose(result, image, atol=1e-6)


def test_a_gain_on_the_light_hardly_matters() -> None:
    """Ratios to the surround: half the light gives nearly the same picture, which no curve of single values does."""
    image = 0.2 + 0.8 * dark_picture((40, 50))
    full, half = Msrcr()(image), Msrcr()(image / 2)
    assert (full - half).abs().mean() < 0.01
    assert (image - image / 2).abs().mean() > 0.1


def test_a_dark_side_comes_up() -> None:
    image = dark_picture((48, 64))
    result = Msrcr()(image)
    left, right = image[..., :20].mean() / image[..., -20:].mean(), result[..., :20].mean() / result[..., -20:].mean()
    assert right > 1.5 * left


@pytest.mark.parametrize("size", [(16, 16), (17, 33), (41, 16)])
def test_odd_sizes_and_a_batch_as_its_pictures(size: tuple[int, int]) -> None:
    image = dark_picture(size, batch=2)
    result = Msrcr()(image)
    assert result.shape == image.shape
    assert torch.allclose(result, torch.cat([Msrcr()(image[:1]), Msrcr()(image[1:])]), atol=1e-5)


def test_hard_edges_and_single_lights_stay_finite() -> None:
    image = torch.zeros(2, 3, 20, 30)
    image[0, ..., 11:] = 1
    image[1, :, 7, 9] = 1
    for finish in ("stretch", "gain"):
        result = Msrcr(finish=finish)(image)
        assert torch.isfinite(result).all()
        assert 0 <= result.min() <= result.max() <= 1


@pytest.mark.parametrize(
    "arguments",
    [
        {"sigmas": []},
        {"sigmas": [0.5]},
        {"alpha": 0},
        {"beta": -1},
        {"finish": "both"},
        {"clip": 0.5},
        {"clip": -0.1},
        {"gain": 0},
    ],
)
def test_a_setting_that_msrcr_cannot_use_is_one_sentence(arguments: dict) -> None:
    with pytest.raises(UserError, match="msrcr needs"):
        Msrcr(**arguments)
