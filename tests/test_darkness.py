"""Eq. 9 and what lies beyond it, against hand-made numbers."""

import json
import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from diffnav.darkness import Darkening, DarknessModel, apply_gamma, darken, invert_gamma
from diffnav.errors import UserError
from diffnav.images import from_uint8, jpeg_round_trip, quantise

VARIED = DarknessModel((2.0, 5.5), (70, 98), (0.001, 0.01), (0.0, 0.004), (1.0, 9.0), 0.05)


def grey(*levels: float) -> torch.Tensor:
    """(3, 1, N) from values on 0 .. 255."""
    return (torch.tensor(levels, dtype=torch.float64) / 255).expand(3, 1, -1)


@pytest.mark.parametrize(
    ("maximum", "gamma", "expected"), [(255, 3, 32.25), (255, 4, 16.19), (255, 5, 8.13), (200, 4, 33.55)]
)
def test_values_of_eq_9(maximum, gamma, expected):
    record = Darkening(gamma=gamma, maximum=maximum / 255)
    dark = apply_gamma(grey(128, maximum, 0), record)[1, 0] * 255
    assert dark[0].item() == pytest.approx(expected, abs=0.005)
    assert dark[1].item() == pytest.approx(maximum, abs=1e-4), "the maximum maps to itself"
    assert dark[2].item() == 0
    # The same through the paper's own form, A I^gamma on [0, 1].
    assert record.A * (128 / 255) ** gamma * 255 == pytest.approx(expected, abs=0.005)


def test_black_stays_black():
    black = torch.zeros(3, 16, 16)
    record = DarknessModel().draw(0.0, seed=1)
    assert record.A == 0
    for image in (apply_gamma(black, record), darken(black, record), invert_gamma(black, 4.0, 0.0)):
        assert torch.equal(image, black)


@settings(max_examples=30, deadline=None)
@given(st.floats(0.5, 6), st.floats(0.05, 1), st.integers(0, 2**31))
def test_invert_gamma_inverts(gamma, maximum, seed):
    image = torch.rand(3, 4, 5, dtype=torch.float64, generator=torch.Generator().manual_seed(seed)) * maximum
    dark = apply_gamma(image, Darkening(gamma=gamma, maximum=maximum))
    assert (dark <= maximum + 1e-12).all()
    torch.testing.assert_close(invert_gamma(dark, gamma, maximum), image, rtol=1e-9, atol=1e-9)


def test_invert_gamma_clips():
    assert invert_gamma(torch.tensor([-0.1, 0.0, 1.0, 1.3]), 2.0).tolist() == [0, 0, 1, 1]


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**31 - 1), st.floats(0, 1))
def test_draw_is_pure_and_within_its_ranges(seed, maximum):
    record = VARIED.draw(maximum, seed)
    assert record == VARIED.draw(maximum, seed)
    assert record.maximum == maximum
    assert 2 <= record.gamma <= 5.5
    assert record.quality in range(70, 99)
    assert 0.001 <= record.shot <= 0.01
    assert 0 <= record.read <= 0.004
    assert 1 <= record.blur_px <= 9
    assert 0 <= record.blur_deg < 180
    assert all(0.95 <= gain <= 1.05 for gain in record.cast)


def test_models_that_differ_in_noise_share_their_gammas():
    plain = DarknessModel((2.0, 5.5))
    assert [plain.draw(1, s).gamma for s in range(50)] == [VARIED.draw(0.7, s).gamma for s in range(50)]


def test_gamma_is_uniform_and_quality_reaches_both_ends():
    records = [VARIED.draw(1, seed) for seed in range(3000)]
    gammas = np.array([record.gamma for record in records])
    # The standard error of the mean of 3,000 draws is .018, of their deviation .009.
    assert gammas.mean() == pytest.approx(3.75, abs=0.08)
    assert gammas.std() == pytest.approx(3.5 / math.sqrt(12), abs=0.05)
    assert {record.quality for record in records} == set(range(70, 99))


def test_the_default_is_the_paper():
    record = DarknessModel().draw(1, seed=3)
    assert 3 <= record.gamma <= 5
    assert (record.quality, record.shot, record.read, record.blur_px, record.cast) == (95, 0, 0, 1, (1, 1, 1))


def test_darken_is_eq_9_then_8_bit_then_jpeg():
    image = from_uint8(np.random.default_rng(0).integers(0, 201, (32, 48, 3), dtype=np.uint8))
    maximum = image.max().item()
    eight_bit = np.round(maximum * (image.numpy() / maximum) ** 3.5 * 255)
    plain = darken(image, Darkening(gamma=3.5, maximum=maximum, quality=0))
    np.testing.assert_allclose(plain * 255, eight_bit, atol=1e-4)
    levels = np.ascontiguousarray(np.moveaxis(eight_bit.astype(np.uint8), 0, 2))
    stored = darken(image, Darkening(gamma=3.5, maximum=maximum, quality=80))
    assert torch.equal(stored, from_uint8(jpeg_round_trip(levels, 80)))


def test_noise_has_the_stated_variance():
    image = torch.full((3, 400, 400), 0.36)
    record = Darkening(gamma=1.0, maximum=1.0, quality=0, seed=5, shot=0.05, read=0.02)
    noisy = darken(image, record)
    expected = 0.05**2 * 0.36 + 0.02**2 + 1 / (12 * 255**2)  # the last for rounding to 8 bit
    assert (noisy - image).mean().item() == pytest.approx(0, abs=3e-4)
    assert noisy.var().item() == pytest.approx(expected, rel=0.02)
    assert torch.equal(noisy, darken(image, record)), "the record holds the noise's seed"
    assert not torch.equal(noisy, darken(image, Darkening(**{**record.__dict__, "seed": 6})))


def test_cast_scales_the_channels_before_eq_9():
    image = torch.full((3, 4, 4), 0.5)
    dark = darken(image, Darkening(gamma=2.0, maximum=1.0, quality=0, cast=(1.2, 1.0, 0.8)))
    expected = torch.tensor([0.6, 0.5, 0.4]).square()
    assert torch.equal(dark[:, 2, 1], quantise(expected))


def blurred_impulse(length: float, degrees: float, size: int = 41) -> np.ndarray:
    image = torch.zeros(3, size, size)
    image[:, size // 2, size // 2] = 1
    record = Darkening(gamma=1.0, maximum=1.0, quality=0, blur_px=length, blur_deg=degrees)
    return darken(image, record)[0].numpy().astype(np.float64)


def test_motion_blur_by_hand():
    rows = {0: [1, 2, 2, 2, 1], 90: [1, 2, 2, 2, 1]}
    for degrees, weights in rows.items():
        spread = blurred_impulse(5, degrees)
        line = spread[20] if degrees == 0 else spread[:, 20]
        np.testing.assert_allclose(line[18:23], np.array(weights) / 8, atol=0.5 / 255)
        assert spread.sum() == pytest.approx(line[18:23].sum(), abs=1e-6)
    assert blurred_impulse(1, 30)[20, 20] == 1


@pytest.mark.parametrize("degrees", [0, 30, 45, 90, 120, 170])
@pytest.mark.parametrize("length", [3.0, 7.5, 12.0])
def test_motion_blur_spreads_along_the_line(length, degrees):
    spread = blurred_impulse(length, degrees)
    y, x = np.mgrid[-20:21, -20:21]
    assert spread.sum() == pytest.approx(1, abs=0.05)
    along = x * math.cos(math.radians(degrees)) + y * math.sin(math.radians(degrees))
    across = y * math.cos(math.radians(degrees)) - x * math.sin(math.radians(degrees))
    total = spread.sum()
    assert (spread * along).sum() / total == pytest.approx(0, abs=0.05)
    # A uniform line of length - 1, widened by bilinear sampling (variance at most 1/4 along each axis).
    variance = (spread * along**2).sum() / total
    assert (length - 1) ** 2 / 12 - 0.1 <= variance <= (length - 1) ** 2 / 12 + 0.35
    assert (spread * across**2).sum() / total <= 0.3
    assert np.abs(along[spread > 0]).max() <= (length - 1) / 2 + math.sqrt(2)


def test_motion_blur_keeps_mean_and_constant_images():
    flat = torch.full((3, 24, 40), 100 / 255)
    record = Darkening(gamma=1.0, maximum=1.0, quality=0, blur_px=9.0, blur_deg=37.0)
    torch.testing.assert_close(darken(flat, record), flat)
    image = torch.full((3, 64, 64), 100 / 255)
    image[:, 16:48, 16:48] = torch.rand(3, 32, 32, generator=torch.Generator().manual_seed(0))
    assert darken(image, record).mean().item() == pytest.approx(image.mean().item(), abs=1e-4)


def test_numbers_are_json_without_the_image():
    record = Darkening(**{**VARIED.draw(0.8, seed=2).__dict__, "normal": torch.rand(3, 4, 4)})
    stored = json.loads(json.dumps(record.numbers()))
    assert stored.pop("A") == pytest.approx(0.8 ** (1 - record.gamma))
    assert "normal" not in stored
    assert Darkening(**{**stored, "cast": tuple(stored["cast"])}) == record


@pytest.mark.parametrize(
    "settings",
    [
        {"gamma": (5.0, 3.0)},
        {"gamma": 4.0},
        {"gamma": (0.0, 3.0)},
        {"gamma": (3.0, math.inf)},
        {"gamma": (math.nan, 3.0)},
        {"gamma": "34"},
        {"shot": (-0.1, 0.1)},
        {"read": (0.1,)},
        {"blur_px": (1, 2, 3)},
        {"quality": (90, 101)},
        {"quality": (90.5, 95)},
        {"cast": 1.0},
        {"cast": -0.1},
        {"cast": (0.1, 0.2)},
    ],
)
def test_wrong_settings_are_one_sentence(settings):
    (name,) = settings
    with pytest.raises(UserError, match=rf"^darkness\.{name} must [^\n]+$"):
        DarknessModel(**settings)
