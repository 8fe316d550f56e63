"""What a camera makes of a view: drawn within its ranges, applied as the record says."""

import math

import numpy as np
import pytest
import torch

from diffnav.data.queries.camera import Camera, Capture, photograph
from diffnav.errors import UserError
from diffnav.images import from_uint8, jpeg_round_trip, quantise

CAMERA = Camera((0.2, 1.5), 0.2, 0.05, (0.01, 0.03), 90)


def test_draws_are_pure_fill_their_ranges_and_differ_by_channel() -> None:
    captures = [CAMERA.draw(seed) for seed in range(500)]
    assert captures[7] == CAMERA.draw(7)
    for values, low, high in (
        ([capture.blur_px for capture in captures], 0.2, 1.5),
        ([capture.noise for capture in captures], 0.01, 0.03),
        ([value for capture in captures for value in capture.gain], 0.8, 1.2),
        ([value for capture in captures for value in capture.offset], -0.05, 0.05),
    ):
        assert low <= min(values) < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < max(values) <= high
        # Four standard errors of the mean of 500 even draws.
        assert np.mean(values) == pytest.approx((low + high) / 2, abs=4 * (high - low) / math.sqrt(12 * 500))
    assert all(len(set(capture.gain)) == 3 for capture in captures)
    assert {capture.quality for capture in captures} == {90}


def test_gain_and_offset_by_hand() -> None:
    view = torch.full((3, 4, 5), 0.4)
    picture = photograph(view, Capture(gain=(1.25, 1.0, 0.5), offset=(0.1, -0.05, 0.0), quality=0))
    torch.testing.assert_close(picture[:, 2, 3] * 255, torch.tensor([153.0, 89.0, 51.0]))
    bright = photograph(torch.ones(3, 2, 2), Capture(gain=(1.2, 1.0, 1.0), offset=(0.0, 0.1, -1.0), quality=0))
    assert bright[:, 0, 0].tolist() == [1, 1, 0]


def test_noise_is_white_and_of_the_stated_deviation() -> None:
    flat = torch.full((3, 300, 300), 0.5)
    noise = photograph(flat, Capture(noise=0.02, seed=4, quality=0)) - quantise(flat)
    # Rounding to 8 bit adds a twelfth of a level squared.
    expected = math.sqrt(0.02**2 + 1 / (12 * 255**2))
    for channel in noise:
        assert channel.std().item() == pytest.approx(expected, rel=0.02)
        # The correlation of 90,000 independent pairs has a standard error of .0033.
        neighbours = np.corrcoef(channel[:, 1:].flatten(), channel[:, :-1].flatten())[0, 1]
        assert abs(neighbours) < 0.015
    assert abs(np.corrcoef(noise[0].flatten(), noise[1].flatten())[0, 1]) < 0.015
    again = photograph(flat, Capture(noise=0.02, seed=4, quality=0)) - quantise(flat)
    other = photograph(flat, Capture(noise=0.02, seed=5, quality=0)) - quantise(flat)
    assert torch.equal(noise, again)
    assert not torch.equal(noise, other)


def test_blur_has_the_stated_width_and_comes_before_noise() -> None:
    point = torch.zeros(3, 31, 31)
    point[:, 15, 15] = 1
    spread = photograph(point, Capture(blur_px=1.5, quality=0))[0]
    y, x = torch.meshgrid(torch.arange(-15.0, 16), torch.arange(-15.0, 16), indexing="ij")
    for axis in (x, y):
        # Cut at three deviations, and rounded to 8 bit.
        assert ((spread * axis**2).sum() / spread.sum()).item() == pytest.approx(1.5**2, rel=0.1)
    noisy = photograph(torch.full((3, 200, 200), 0.5), Capture(blur_px=1.5, noise=0.02, quality=0))
    assert noisy.std().item() == pytest.approx(0.02, rel=0.03)


def test_it_ends_in_8_bit_and_jpeg() -> None:
    view = torch.rand(3, 40, 48, generator=torch.Generator().manual_seed(0))
    assert torch.equal(photograph(view, Capture(quality=0)), quantise(view))
    levels = (view * 255).round().byte().permute(1, 2, 0).contiguous().numpy()
    assert torch.equal(photograph(view, Capture(quality=80)), from_uint8(jpeg_round_trip(levels, 80)))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"blur_px": (1.0, 0.5)}, r"query_set\.camera\.blur_px must be two numbers"),
        ({"blur_px": 1.0}, r"query_set\.camera\.blur_px must be two numbers"),
        ({"noise": (0.0, 0.6)}, r"query_set\.camera\.noise must be two numbers, low and high, from 0 to 0\.5"),
        ({"noise": (0.0, math.nan)}, r"query_set\.camera\.noise"),
        ({"gain": 1.0}, r"query_set\.camera\.gain must be a number from 0 to 0\.9, got 1\.0"),
        ({"offset": (0.0, 0.1)}, r"query_set\.camera\.offset must be a number"),
        ({"quality": 101}, r"query_set\.camera\.quality"),
        ({"quality": 90.5}, r"query_set\.camera\.quality must be a whole number"),
    ],
)
def test_wrong_settings_are_one_sentence(settings: dict, message: str) -> None:
    with pytest.raises(UserError, match=message):
        Camera(**settings)
