"""Pictures varied before they are darkened: the right window, the right curve, and nothing where nothing is asked."""

import numpy as np
import pytest
import torch

from diffnav.darkness import DarknessModel
from diffnav.data.pairs import TrainingPairs
from diffnav.data.photos import Photo
from diffnav.data.store import PhotoStore
from diffnav.data.variation import Variation, expose, shrink_around
from diffnav.errors import UserError
from diffnav.images import from_uint8

RAMP = np.stack(np.broadcast_arrays(np.arange(120)[None, :] * 2, np.arange(80)[:, None] * 3, 7), -1).astype(np.uint8)


def make_store() -> PhotoStore:
    return PhotoStore([Photo("ramp", "ramp", lambda: from_uint8(RAMP))], None, smallest=16)


def test_a_picture_shrunk_by_half_is_the_mean_of_squares_of_four():
    levels = np.random.default_rng(0).integers(0, 256, (80, 120, 3), dtype=np.uint8)
    small = shrink_around(levels, top=10, left=20, side=16, zoom=0.5)
    for y in range(16):
        for x in range(16):
            four = levels[10 + 2 * y : 12 + 2 * y, 20 + 2 * x : 22 + 2 * x].astype(float).mean((0, 1))
            assert np.abs(small[y, x] - four).max() <= 0.51


def test_a_window_that_would_leave_the_picture_moves_inwards_or_shrinks_less():
    moved = shrink_around(RAMP, top=79, left=119, side=16, zoom=0.5)
    assert np.array_equal(moved, shrink_around(RAMP, top=48, left=88, side=16, zoom=0.5))
    least = shrink_around(RAMP, top=5, left=5, side=64, zoom=0.1)
    assert np.array_equal(least, shrink_around(RAMP, top=0, left=5, side=64, zoom=0.8))


def test_exposure_is_an_exponent():
    levels = np.array([[[0, 64, 255]]], np.uint8)
    assert expose(levels, 2.0).tolist() == [[[0, 16, 255]]]  # 64^2 / 255 = 16.06
    assert expose(levels, 0.5).tolist() == [[[0, 128, 255]]]  # sqrt(64 * 255) = 127.7


def test_without_variation_the_samples_are_those_of_before():
    store, darkness = make_store(), DarknessModel()
    plain = TrainingPairs(store, darkness, 32, seed=3)[5]
    fixed = TrainingPairs(store, darkness, 32, seed=3, variation=Variation())[5]
    assert all(torch.equal(plain[key], fixed[key]) for key in plain)


def test_dark_and_daylight_show_the_same_varied_view():
    nothing_dark = DarknessModel(gamma=(1.0, 1.0), quality=(0, 0))
    pairs = TrainingPairs(make_store(), nothing_dark, 32, variation=Variation((0.4, 0.9), (0.7, 1.4)))
    for number in range(8):
        assert (pairs[number]["low"] - pairs[number]["normal"]).abs().max() <= 0.51 / 255
    assert not torch.equal(pairs[0]["normal"], pairs[1]["normal"])


@pytest.mark.parametrize("wrong", [{"zoom": (0.5, 1.2)}, {"zoom": (0, 1)}, {"exposure": (1.2, 0.8)}])
def test_wrong_ranges_are_one_sentence(wrong):
    with pytest.raises(UserError, match=rf"data\.variation\.{next(iter(wrong))} "):
        Variation(**wrong)
