"""Coherence and gain per octave: hand-computed sinusoids, the definition in plain loops, a network's parts."""

import cmath
import math

import pytest
import torch

from diffnav.evaluation.spectrum import BANDS, band_figures, part_luminances
from diffnav.retinex.enhancer import RetinexEnhancer

SIDE = 512
# Cycles per side, one in the middle of every octave.
CYCLES = (192, 96, 48, 24, 12, 6)


def noise(height: int, width: int, seed: int = 0) -> torch.Tensor:
    return torch.rand(height, width, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def wave(cycles: int, along: int = 1) -> torch.Tensor:
    """A cosine of amplitude 1 with so many cycles along an axis: under the window it stays within 1 bin of them."""
    x = torch.arange(SIDE, dtype=torch.float64)
    line = torch.cos(2 * math.pi * cycles * x / SIDE + 0.7)
    return line.expand(SIDE, SIDE) if along == 1 else line[:, None].expand(SIDE, SIDE)


def waves() -> torch.Tensor:
    return sum((wave(cycles) for cycles in CYCLES), torch.zeros(SIDE, SIDE))


def figures_of(image: torch.Tensor, normal: torch.Tensor) -> tuple[list[float], list[float]]:
    coherences, gains = zip(*band_figures(image, normal), strict=True)
    return list(coherences), list(gains)


def test_the_bands_are_octaves():
    assert BANDS == [
        (1 / 4, 1 / 2),
        (1 / 8, 1 / 4),
        (1 / 16, 1 / 8),
        (1 / 32, 1 / 16),
        (1 / 64, 1 / 32),
        (1 / 128, 1 / 64),
    ]


@pytest.mark.parametrize("size", [(256, 256), (193, 301)])
def test_a_picture_against_itself_and_in_other_contrast(size):
    normal = noise(*size)
    coherence, gain = figures_of(normal, normal)
    assert coherence == pytest.approx([1] * 6, abs=1e-9)
    assert gain == pytest.approx([1] * 6, abs=1e-9)
    coherence, gain = figures_of(0.2 + 0.3 * normal, normal)
    assert coherence == pytest.approx([1] * 6, abs=1e-9)
    assert figures_of(1 - normal, normal)[0] == pytest.approx([-1] * 6, abs=1e-9)
    assert gain == pytest.approx([0.3] * 6, abs=1e-9)


@pytest.mark.parametrize("band", range(6))
def test_a_sinusoid_that_daylight_lacks_changes_its_band_alone(band):
    # Of the same frequency and of amplitude 3/4, across: powers add, 1 + 9/16 = (5/4)^2.
    coherence, gain = figures_of(waves() + 0.75 * wave(CYCLES[band], along=0), waves())
    expected_coherence, expected_gain = [1.0] * 6, [1.0] * 6
    expected_coherence[band], expected_gain[band] = 0.8, 1.25
    assert coherence == pytest.approx(expected_coherence, abs=1e-6)
    assert gain == pytest.approx(expected_gain, abs=1e-6)


def test_a_blur_loses_the_gain_of_its_transfer_function():
    sigma = 1.5
    x = torch.arange(-12, 13, dtype=torch.float64)
    kernel = torch.exp(-(x**2) / (2 * sigma**2))
    kernel /= kernel.sum()
    blurred = sum(weight * waves().roll(int(shift), 1) for weight, shift in zip(kernel, x, strict=True))
    coherence, gain = figures_of(blurred, waves())
    assert coherence == pytest.approx([1] * 6, abs=1e-4)
    expected = [math.exp(-2 * (math.pi * sigma * cycles / SIDE) ** 2) for cycles in CYCLES]
    assert expected[0] == pytest.approx(0.00194, abs=1e-5)
    assert gain == pytest.approx(expected, rel=1e-3)


def test_unrelated_noise_is_not_coherent():
    coherence, gain = figures_of(noise(256, 256, 1), noise(256, 256, 2))
    assert max(abs(value) for value in coherence[:2]) < 0.05
    assert gain[:2] == pytest.approx([1] * 2, abs=0.05)


def test_the_definition_in_plain_loops_on_odd_sides():
    height, width = 13, 11
    image, normal = noise(height, width, 1), noise(height, width, 2)

    def coefficient(picture: torch.Tensor, v: int, u: int) -> complex:
        mean, total = float(picture.mean()), 0j
        for y in range(height):
            for x in range(width):
                hann = math.sin(math.pi * y / height) ** 2 * math.sin(math.pi * x / width) ** 2
                turn = cmath.exp(-2j * math.pi * (v * y / height + u * x / width))
                total += (float(picture[y, x]) - mean) * hann * turn
        return total

    for (low, high), figures in zip(BANDS, band_figures(image, normal), strict=True):
        common, power, power_normal = 0j, 0.0, 0.0
        for v in range(-(height // 2), height // 2 + 1):
            for u in range(-(width // 2), width // 2 + 1):
                if low < math.hypot(v / height, u / width) <= high:
                    e, n = coefficient(image, v, u), coefficient(normal, v, u)
                    common, power, power_normal = (
                        common + e * n.conjugate(),
                        power + abs(e) ** 2,
                        power_normal + abs(n) ** 2,
                    )
        if power_normal == 0:
            # The lowest frequency of so small a picture is 1/13.
            assert high <= 1 / 16
            assert figures == (None, None)
        else:
            assert figures.coherence == pytest.approx(common.real / math.sqrt(power * power_normal), abs=1e-12)
            assert figures.gain == pytest.approx(math.sqrt(power / power_normal), abs=1e-12)


def test_flat_pictures():
    flat, normal = torch.full((64, 64), 0.3), noise(64, 64)
    assert figures_of(flat, normal)[0][:5] == [0] * 5
    assert figures_of(flat, normal)[1][:5] == [0] * 5
    assert set(band_figures(normal, flat)) == {(None, None)}


def test_parts_of_a_network_are_its_components_in_tiles_too():
    torch.manual_seed(0)
    enhancer = RetinexEnhancer(width=4).eval()
    low = torch.rand(3, 251, 243)
    parts = enhancer.components(low[None])
    R = parts.R[0]
    expected = {"R": 0.299 * R[0] + 0.587 * R[1] + 0.114 * R[2], "Ih": parts.Ih[0, 0]}
    for tile_pixels in (100_000, 208**2):
        enhancer.tile_pixels = tile_pixels
        found = part_luminances(enhancer, low)
        assert list(found) == ["R", "Ih"]
        for name, values in expected.items():
            assert not found[name].requires_grad
            assert torch.allclose(found[name], values, atol=1e-5)
