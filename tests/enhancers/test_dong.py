"""Dong: PAPER 9 in slow loops, and what follows from it by hand."""

import numpy as np
import pytest
import torch
from torch import Tensor

from diffnav.enhancers.dong import Dong, haze_light, minimum_filter, transmission
from diffnav.errors import UserError


def random_image(height: int, width: int, seed: int = 0, darkest: float = 0.0, brightest: float = 0.6) -> Tensor:
    dice = torch.Generator().manual_seed(seed)
    return darkest + (brightest - darkest) * torch.rand(1, 3, height, width, generator=dice)


def slowly(S: np.ndarray, share: float = 0.002) -> np.ndarray:
    """PAPER 9 pixel by pixel: (H, W, 3) -> the same."""
    height, width, _ = S.shape
    Q = np.pad(1 - S, ((10, 10), (10, 10), (0, 0)), mode="edge")
    D = np.empty_like(Q)
    for y in range(height + 20):
        for x in range(width + 20):
            D[y, x] = Q[max(0, y - 3) : y + 4, max(0, x - 3) : x + 4].min(axis=(0, 1))
    places = sorted(((D[y, x].min(), y, x) for y in range(height + 20) for x in range(width + 20)), reverse=True)
    count = max(1, int(share * len(places)))
    haziest = [(Q[y, x].mean(), y, x) for d, y, x in places if d >= places[count - 1][0]]
    A = Q[max(haziest)[1:]]
    out = np.empty_like(S)
    for y in range(height):
        for x in range(width):
            q, d = Q[y + 10, x + 10], D[y + 10, x + 10]
            t = max(1 - 0.8 * min(d / A), 1e-7)
            if t < 0.5:
                t = 2 * t * t
            out[y, x] = 1 - ((q - A) / t + A)
    return out.clip(0, 1)


@pytest.mark.parametrize(("size", "share"), [((17, 23), 0.002), ((20, 16), 0.05), ((31, 40), 0.002)])
def test_against_slow_loops(size: tuple[int, int], share: float) -> None:
    # Coarse blobs, so that the minimum filter sees dark and bright regions, and 8 bit, so that values tie.
    coarse = random_image(-(-size[0] // 6), -(-size[1] // 6), brightest=0.9).repeat_interleave(6, 2)
    image = (
        coarse.repeat_interleave(6, 3)[..., : size[0], : size[1]] + random_image(*size, seed=1, brightest=0.1)
    ) * 0.9
    image = (255 * image).round() / 255
    expected = slowly(image[0].permute(1, 2, 0).double().numpy(), share)
    result = Dong(share=share)(image)[0].permute(1, 2, 0).numpy()
    assert ((expected > 0) & (expected < 1)).mean() > 0.2
    assert np.abs(result - expected).max() < 1e-4


def test_the_minimum_filter_of_one_dark_pixel() -> None:
    image = torch.ones(1, 3, 9, 11)
    image[0, 1, 4, 2] = 0.25
    filtered = minimum_filter(image, 5)
    expected = torch.ones(1, 3, 9, 11)
    expected[0, 1, 2:7, 0:5] = 0.25
    assert torch.equal(filtered, expected)


def test_the_light_is_the_brightest_of_the_haziest() -> None:
    """Two of a hundred pixels take part: the hazier is not the brighter, and the brightest of all is not hazy."""
    Q, D = torch.full((1, 3, 10, 10), 0.3), torch.full((1, 3, 10, 10), 0.1)
    for place, colour, dark in [
        ((2, 3), (0.9, 0.8, 0.8), 0.8),
        ((7, 1), (0.8, 1.0, 0.9), 0.7),
        ((5, 5), (1.0, 1.0, 1.0), 0.6),
    ]:
        Q[0, :, place[0], place[1]] = torch.tensor(colour)
        D[0, :, place[0], place[1]] = dark
    assert haze_light(Q, D, 0.02).flatten().tolist() == pytest.approx([0.8, 1.0, 0.9])
    assert haze_light(Q, D, 0.03).flatten().tolist() == pytest.approx([1.0, 1.0, 1.0])
    assert haze_light(Q, D, 0.001).flatten().tolist() == pytest.approx([0.9, 0.8, 0.8])


def test_all_that_ties_takes_part_in_the_light() -> None:
    Q, D = torch.full((1, 3, 10, 10), 0.5), torch.full((1, 3, 10, 10), 0.5)
    Q[0, :, 9, 9] = 0.75
    assert haze_light(Q, D, 0.02).flatten().tolist() == [0.75] * 3


def test_transmission_by_hand() -> None:
    """min D / A = .5: 1 - .4 = .6 stays; 1: .2 -> .08; the smallest channel counts; D above A stays above 0."""
    D = torch.tensor([[0.4, 0.8, 0.9], [0.8, 0.8, 0.9], [0.8, 0.0, 0.9], [4.0, 4.0, 4.0]]).T.reshape(1, 3, 1, 4)
    A = torch.full((1, 3, 1, 1), 0.8)
    t = transmission(D, A, 0.8).flatten()
    assert t.tolist()[:3] == pytest.approx([0.6, 0.08, 1.0], abs=1e-6)
    assert 0 < t[3] < 1e-12


@pytest.mark.parametrize("value", [0.0, 0.1, 0.5, 0.998, 1.0])
def test_one_colour_stays_as_it_is(value: float) -> None:
    """Q = A everywhere, so J = A whatever t."""
    image = torch.full((1, 3, 16, 21), value)
    image[:, 1] *= 0.9
    assert torch.allclose(Dong()(image), image, atol=1e-6)


def test_the_dark_gets_brighter_and_keeps_its_order() -> None:
    """Under one haze, A = 1 from the black part, a gain of 1 / t: the darker the region, the larger."""
    image = torch.zeros(1, 3, 64, 128)
    for k, value in enumerate((0.0, 0.02, 0.05, 0.1, 0.3, 0.6, 0.8, 0.95)):
        image[..., 16 * k : 16 * k + 16] = value
    middles = Dong()(image)[0, 0, 32, 8::16].tolist()
    assert middles[0] == 0
    assert middles == sorted(middles)
    # t of the region of .05 is 1 - .8 * .95 = .24 -> .1152.
    assert middles[2] == pytest.approx(0.05 / 0.1152, abs=1e-5)


def test_odd_sizes_and_batches() -> None:
    batch = torch.cat([random_image(17, 31), random_image(17, 31, 1, brightest=0.1), torch.zeros(1, 3, 17, 31)])
    result = Dong()(batch)
    assert result.shape == batch.shape
    assert torch.isfinite(result).all()
    for one, alone in zip(result, batch, strict=True):
        assert torch.equal(one, Dong()(alone[None])[0])


@pytest.mark.parametrize(
    "settings", [{"strength": 0}, {"strength": 1.1}, {"window": 6}, {"window": -1}, {"share": 0}, {"share": 2}]
)
def test_impossible_settings_are_one_sentence(settings: dict) -> None:
    with pytest.raises(UserError, match="dong needs"):
        Dong(**settings)
