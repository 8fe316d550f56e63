"""PSNR and SSIM against slow transcriptions of their formulas."""

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from diffnav.scores import psnr, ssim


def slow_psnr(image: list, normal: list) -> float:
    """10 log10(1 / MSE) over 8-bit values, one by one."""
    errors = [
        (round(255 * min(max(a, 0.0), 1.0)) / 255 - round(255 * b) / 255) ** 2
        for plane_a, plane_b in zip(image, normal, strict=True)
        for row_a, row_b in zip(plane_a, plane_b, strict=True)
        for a, b in zip(row_a, row_b, strict=True)
    ]
    return 10 * math.log10(1 / (sum(errors) / len(errors)))


def slow_ssim(image: Tensor, normal: Tensor) -> float:
    """Wang 2004, window by window: Gaussian of 11 x 11, sigma 1.5, reflected borders."""
    weights = [math.exp(-(k**2) / (2 * 1.5**2)) for k in range(-5, 6)]
    total = sum(weights)
    weights = [w / total for w in weights]
    x = [[[round(255 * v) / 255 for v in row] for row in plane] for plane in image.tolist()]
    y = [[[round(255 * v) / 255 for v in row] for row in plane] for plane in normal.tolist()]
    height, width = len(x[0]), len(x[0][0])

    def reflect(i: int, n: int) -> int:
        return -i if i < 0 else 2 * (n - 1) - i if i >= n else i

    values = []
    for channel in range(3):
        for row in range(height):
            for column in range(width):
                sums = [0.0] * 5
                for dy in range(-5, 6):
                    for dx in range(-5, 6):
                        w = weights[dy + 5] * weights[dx + 5]
                        at_y, at_x = reflect(row + dy, height), reflect(column + dx, width)
                        a, b = x[channel][at_y][at_x], y[channel][at_y][at_x]
                        sums = [s + w * v for s, v in zip(sums, (a, b, a * a, b * b, a * b), strict=True)]
                mean_a, mean_b, aa, bb, ab = sums
                c1, c2 = 0.01**2, 0.03**2
                upper = (2 * mean_a * mean_b + c1) * (2 * (ab - mean_a * mean_b) + c2)
                lower = (mean_a**2 + mean_b**2 + c1) * (aa - mean_a**2 + bb - mean_b**2 + c2)
                values.append(upper / lower)
    return sum(values) / len(values)


def pictures(seed: int, shape: tuple[int, ...]) -> tuple[Tensor, Tensor]:
    dice = torch.Generator().manual_seed(seed)
    normal = torch.rand(shape, generator=dice)
    return (normal + 0.2 * torch.randn(shape, generator=dice)).clamp(0, 1), normal


@pytest.mark.parametrize("seed", [0, 1])
def test_psnr_equals_its_formula(seed: int) -> None:
    image, normal = pictures(seed, (2, 3, 7, 9))
    expected = [slow_psnr(a.tolist(), b.tolist()) for a, b in zip(image, normal, strict=True)]
    assert psnr(image, normal).tolist() == pytest.approx(expected, abs=1e-4)


def test_ssim_equals_its_formula() -> None:
    image, normal = pictures(2, (1, 3, 12, 9))
    assert ssim(image, normal).item() == pytest.approx(slow_ssim(image[0], normal[0]), abs=1e-5)


def test_hand_made_values() -> None:
    """One level of 255 off everywhere: 20 log10(255) = 48.1308 dB; black against white: 0 dB, SSIM c1 / (1 + c1)."""
    grey = torch.full((1, 3, 16, 16), 100 / 255)
    assert psnr(grey, grey + 1 / 255).item() == pytest.approx(48.1308, abs=1e-3)
    black, white = torch.zeros(1, 3, 16, 16), torch.ones(1, 3, 16, 16)
    assert psnr(black, white).item() == pytest.approx(0, abs=1e-6)
    assert ssim(black, white).item() == pytest.approx(1e-4 / (1 + 1e-4), abs=1e-6)


def test_equal_pictures_have_the_best_scores() -> None:
    for image in (torch.zeros(1, 3, 8, 8), torch.rand(1, 3, 8, 8, generator=torch.Generator().manual_seed(0))):
        assert psnr(image, image).item() == pytest.approx(120)
        assert ssim(image, image).item() == pytest.approx(1, abs=1e-6)


def test_scores_see_eight_bit_and_the_range() -> None:
    """What a file cannot hold does not count: less than half a level, or values outside [0, 1]."""
    image, normal = pictures(3, (1, 3, 12, 12))
    levels = (image * 255).round() / 255
    assert torch.equal(psnr(levels + 0.3 / 255, normal), psnr(levels, normal))
    white = torch.ones(1, 3, 12, 12)
    assert psnr(white + 3, white).item() == pytest.approx(120)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), strength=st.floats(0.02, 0.3))
def test_more_error_scores_less(seed: int, strength: float) -> None:
    dice = torch.Generator().manual_seed(seed)
    normal = 0.3 + 0.4 * torch.rand(1, 3, 12, 12, generator=dice)
    noise = torch.randn(normal.shape, generator=dice)
    mild, strong = normal + strength * noise, normal + 2 * strength * noise
    assert psnr(strong, normal) < psnr(mild, normal)
    assert ssim(strong, normal) < ssim(mild, normal)
    assert -1 <= ssim(strong, normal).item() <= 1
