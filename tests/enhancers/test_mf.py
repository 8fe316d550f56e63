"""MF: PAPER 9 in slow loops, hue in degrees and all, and what follows from it by hand."""

import colorsys
import math

import cv2
import numpy as np
import pytest
import torch
from torch import Tensor

from diffnav.enhancers.mf import Mf, close_with_disc, fuse, guided_filter, stretch, weights
from diffnav.errors import UserError


def picture(height: int, width: int, seed: int = 0, brightest: float = 0.5) -> Tensor:
    """Regions with noise, colourful, mostly dark."""
    dice = np.random.default_rng(seed)
    coarse = np.kron(dice.random((3, height // 6 + 1, width // 6 + 1)), np.ones((1, 6, 6)))[:, :height, :width]
    values = (0.8 * coarse + 0.2 * dice.random((3, height, width))) ** 2 * brightest
    return torch.from_numpy(values.astype(np.float32))[None]


def slow_extreme(image: np.ndarray, radius: int, choose) -> np.ndarray:
    """The largest or smallest value in the disc around each pixel."""
    height, width = image.shape
    result = np.empty_like(image)
    for y in range(height):
        for x in range(width):
            result[y, x] = choose(
                image[v, u]
                for v in range(max(0, y - radius), min(height, y + radius + 1))
                for u in range(max(0, x - radius), min(width, x + radius + 1))
                if (v - y) ** 2 + (u - x) ** 2 <= radius**2
            )
    return result


def slow_guided_filter(guide: np.ndarray, image: np.ndarray, radius: int, eps: float) -> np.ndarray:
    """He et al. 2013, equations 5, 6 and 8, window by window."""

    def window(y: int, x: int) -> tuple[slice, slice]:
        return slice(max(0, y - radius), y + radius + 1), slice(max(0, x - radius), x + radius + 1)

    a, b, result = np.empty_like(guide), np.empty_like(guide), np.empty_like(guide)
    for y, x in np.ndindex(*guide.shape):
        G, p = guide[window(y, x)], image[window(y, x)]
        a[y, x] = ((G * p).mean() - G.mean() * p.mean()) / (G.var() + eps)
        b[y, x] = p.mean() - a[y, x] * G.mean()
    for y, x in np.ndindex(*guide.shape):
        result[y, x] = a[window(y, x)].mean() * guide[y, x] + b[window(y, x)].mean()
    return result


def reduced(image: np.ndarray) -> np.ndarray:
    """Every second pixel after the 5 x 5 binomial, mirrored at the border."""
    taps = np.array([1, 4, 6, 4, 1]) / 16
    padded = np.pad(image, 2, mode="reflect")
    result = np.empty(((image.shape[0] + 1) // 2, (image.shape[1] + 1) // 2))
    for y, x in np.ndindex(*result.shape):
        result[y, x] = taps @ padded[2 * y : 2 * y + 5, 2 * x : 2 * x + 5] @ taps
    return result


def slow_fuse(versions: list[np.ndarray], weights: list[np.ndarray], levels: int) -> np.ndarray:
    """Burt and Adelson's pyramids, coarse pictures enlarged by cv2.pyrUp (its border is its own)."""

    def enlarged(image: np.ndarray, like: np.ndarray) -> np.ndarray:
        return cv2.pyrUp(image, dstsize=like.shape[::-1])

    bands = []
    for version, weight in zip(versions, weights, strict=True):
        pyramid, weight_pyramid = [version], [weight]
        for _ in range(levels - 1):
            pyramid.append(reduced(pyramid[-1]))
            weight_pyramid.append(reduced(weight_pyramid[-1]))
        laplacian = [pyramid[i] - enlarged(pyramid[i + 1], pyramid[i]) for i in range(levels - 1)] + pyramid[-1:]
        bands.append([w * band for w, band in zip(weight_pyramid, laplacian, strict=True)])
    result = sum(one[-1] for one in bands)
    for level in reversed(range(levels - 1)):
        fine = sum(one[level] for one in bands)
        result = fine + enlarged(result, fine)
    return result


def slowly(S: np.ndarray, levels: int) -> np.ndarray:
    """PAPER 9: (H, W, 3) in [0, 1] -> the same."""
    L = S.max(2)
    closed = slow_extreme(slow_extreme(L, 7, max), 7, min)
    I = slow_guided_filter(L / L.max(), closed, 2, 0.004).clip(1 / 255)
    k = 10 + (1 - I.mean()) / I.mean()
    I3 = cv2.createCLAHE(3.0, (8, 8)).apply(np.round(255 * I).clip(0, 255).astype(np.uint8)) / 255
    versions = [I, 2 / math.pi * np.arctan(k * I), I3]
    raw = np.empty((3, *L.shape))
    for n, y, x in np.ndindex(*raw.shape):
        hue, saturation, _ = colorsys.rgb_to_hsv(*S[y, x])
        B = math.exp(-((versions[n][y, x] - 0.5) ** 2) / (2 * 0.25**2))
        raw[n, y, x] = B * versions[n][y, x] * (1 + math.cos(math.radians(2 * 360 * hue + 250)) * saturation)
    fused = slow_fuse(versions, list(raw / raw.sum(0)), levels)
    return (S / I[..., None] * fused[..., None]).clip(0, 1)


@pytest.mark.parametrize(("size", "levels"), [((33, 40), 3), ((24, 17), 1), ((35, 27), 4)])
def test_against_slow_loops(size: tuple[int, int], levels: int) -> None:
    """With the whole of C_k: its hue and saturation cancel in the normalised weights."""
    image = picture(*size)
    expected = slowly(image[0].permute(1, 2, 0).double().numpy(), levels)
    result = Mf(levels=levels)(image)[0].permute(1, 2, 0).numpy()
    assert np.abs(result - expected).max() < 2e-4
    assert expected.mean() > 1.2 * image.mean()


def test_closing_fills_what_no_disc_fits_into() -> None:
    """A dark spot of 5 x 5 goes, a dark disc of radius 8 stays, and nothing gets darker."""
    y, x = np.mgrid[:60, :60]
    image = np.full((60, 60), 0.8, np.float32)
    image[8:13, 8:13] = 0.1
    disc = (y - 36) ** 2 + (x - 36) ** 2 <= 64
    image[disc] = 0.2
    closed = close_with_disc(image, 7)
    assert (closed[:20, :20] == np.float32(0.8)).all()
    assert closed[36, 36] == np.float32(0.2)
    assert (closed >= image).all()
    assert np.array_equal(close_with_disc(closed, 7), closed)


def test_the_guided_filter_keeps_its_guide_and_its_edges() -> None:
    """Without eps any straight function of the guide comes back; with it a high edge stays, low noise goes."""
    dice = np.random.default_rng(0)
    guide = dice.random((20, 30)).astype(np.float32)
    assert np.allclose(guided_filter(guide, 0.3 * guide + 0.2, 2, 1e-9), 0.3 * guide + 0.2, atol=1e-3)
    step = np.where(np.arange(30) < 15, 0.2, 0.9).astype(np.float32)[None].repeat(20, 0)
    noisy = step + 0.02 * dice.standard_normal((20, 30)).astype(np.float32)
    filtered = guided_filter(noisy, noisy, 2, 0.004)
    assert abs(filtered[:, 14] - 0.2).mean() < 0.05
    assert (filtered - step)[:, 5:10].std() < 0.5 * (noisy - step)[:, 5:10].std()


def test_stretch_by_hand() -> None:
    """Mean .2: k = 10 + 4 = 14."""
    I = np.array([[0.0, 0.1, 0.2, 0.5]], np.float32)
    assert stretch(I)[0].tolist() == pytest.approx([2 / math.pi * math.atan(14 * v) for v in I[0]], abs=1e-6)


def test_weights_by_hand() -> None:
    """I = .25 and .5: B = exp(-.5), 1; W = .25 exp(-.5), .5."""
    one, two = weights([np.full((1, 1), 0.25), np.full((1, 1), 0.5)])
    expected = 0.25 * math.exp(-0.5) / (0.25 * math.exp(-0.5) + 0.5)
    assert one.item() == pytest.approx(expected)
    assert two.item() == pytest.approx(1 - expected)


@pytest.mark.parametrize("levels", [1, 3, 8])
def test_fusing_a_picture_with_itself_gives_it_back(levels: int) -> None:
    dice = np.random.default_rng(0)
    version, share = dice.random((2, 21, 34)).astype(np.float32)
    assert np.allclose(fuse([version, version], [share, 1 - share], levels), version, atol=1e-5)


def test_colours_keep_their_ratios() -> None:
    image = picture(32, 40)
    result = Mf()(image)
    inside = (result.amax(1) < 1)[0]
    assert inside.float().mean() > 0.8
    before, after = (one[0] / one[0].amax(0) for one in (image, result))
    assert torch.allclose(before[:, inside], after[:, inside], atol=1e-4)


@pytest.mark.parametrize("colour", [(0.0, 0.0, 0.0), (0.02, 0.01, 0.0), (0.3, 0.1, 0.6), (1.0, 1.0, 1.0)])
def test_one_colour_stays_one_colour(colour: tuple[float, float, float]) -> None:
    result = Mf()(torch.tensor(colour)[None, :, None, None].expand(1, 3, 19, 26))
    assert torch.isfinite(result).all()
    assert (result.amax((2, 3)) - result.amin((2, 3))).max() < 1e-5
    assert (result[0, :, 0, 0] > 0).tolist() == [value > 0 for value in colour]


def test_pure_colours_whose_chroma_weight_is_zero_are_finite() -> None:
    """Hue 145 degrees at full saturation: cos(2 * 145 + 250 degrees) = -1, so every C_k is 0."""
    image = torch.tensor([0.0, 0.6, 0.25])[None, :, None, None].expand(1, 3, 16, 16)
    assert Mf()(image)[0, 1].min() > 0.1


def test_odd_sizes_and_batches() -> None:
    batch = torch.cat([picture(17, 31), picture(17, 31, 3, brightest=0.05), torch.zeros(1, 3, 17, 31)])
    result = Mf()(batch)
    assert result.shape == batch.shape
    assert result.min() >= 0
    assert result.max() <= 1
    for one, alone in zip(result, batch, strict=True):
        assert torch.equal(one, Mf()(alone[None])[0])


@pytest.mark.parametrize(
    "settings", [{"disc": -1}, {"radius": -1}, {"eps": 0}, {"clip_limit": 0}, {"grid": 0}, {"levels": 0}]
)
def test_impossible_settings_are_one_sentence(settings: dict) -> None:
    with pytest.raises(UserError, match="mf needs"):
        Mf(**settings)
