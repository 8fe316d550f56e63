"""NPE: PAPER 9 in slow loops, hand-made examples, and the properties that it promises."""

import math

import numpy as np
import pytest
import torch
from torch import Tensor

from diffnav.enhancers.npe import Npe, bilog, bright_pass, neighbour_counts
from diffnav.errors import UserError


def random_levels(height: int, width: int, seed: int = 0, below: int = 256) -> np.ndarray:
    """Regions with noise, 8 bit, most of them dark."""
    dice = np.random.default_rng(seed)
    coarse = np.kron(dice.random((height // 5 + 1, width // 5 + 1)), np.ones((5, 5)))[:height, :width]
    return ((0.9 * coarse + 0.1 * dice.random((height, width))) ** 3 * (below - 1)).round().astype(np.uint8)


def picture(height: int, width: int, seed: int = 0, below: int = 256) -> Tensor:
    levels = np.stack([random_levels(height, width, seed + k, below) for k in range(3)])
    return torch.from_numpy(levels.astype(np.float32) / 255)[None]


def slow_counts(levels: np.ndarray, span: int) -> np.ndarray:
    """Q(a, b), averaged over b."""
    height, width = levels.shape
    counts = np.zeros((256, 256))
    for y in range(height):
        for x in range(width):
            for v in range(max(0, y - 1), min(height, y + 2)):
                for u in range(max(0, x - 1), min(width, x + 2)):
                    if (v, u) != (y, x):
                        counts[levels[y, x], levels[v, u]] += 1
    averaged = np.zeros((256, 256))
    for b in range(256):
        averaged[:, b] = counts[:, max(0, b - span // 2) : b + span // 2 + 1].mean(axis=1)
    return averaged


def slow_bright_pass(levels: np.ndarray, Q: np.ndarray, window: int) -> np.ndarray:
    height, width = levels.shape
    result = np.zeros((height, width))
    half = window // 2
    for y in range(height):
        for x in range(width):
            a, weighted, total = int(levels[y, x]), 0.0, 0.0
            for v in range(max(0, y - half), min(height, y + half + 1)):
                for u in range(max(0, x - half), min(width, x + half + 1)):
                    b = int(levels[v, u])
                    if b >= a:
                        weighted += Q[a, b] * b
                        total += Q[a, b]
            result[y, x] = weighted / total if total > 0 else a
    return result


def slow_bilog(L_r: np.ndarray) -> np.ndarray:
    """C and F by their definitions, both straight between whole levels."""
    rounded = np.round(L_r)
    C = [sum(math.log(z + 1) * np.sum(rounded == z) for z in range(v + 1)) for v in range(256)]
    F = [sum(math.log(i + 1) for i in range(z + 1)) for z in range(256)]
    C, F = [c / C[-1] for c in C], [f / F[-1] for f in F]
    mapped = []
    for c in C:
        z = next(z for z in range(256) if F[z] >= c)
        mapped.append(float(z) if z == 0 else z - (F[z] - c) / (F[z] - F[z - 1]))
    low = np.minimum(np.floor(L_r).astype(int), 254)
    mapped = np.array(mapped)
    return mapped[low] + (L_r - low) * (mapped[low + 1] - mapped[low])


@pytest.mark.parametrize(("size", "window", "span"), [((21, 27), 15, 8), ((16, 16), 5, 0), ((25, 17), 7, 30)])
def test_against_slow_loops(size: tuple[int, int], window: int, span: int) -> None:
    image = picture(*size, below=160)
    S = 255 * image[0].double().numpy()
    levels = np.round(S.max(0)).astype(np.uint8)
    L_r = bright_pass(levels, neighbour_counts(levels, span), window)
    assert L_r.mean() > levels.mean() + 2
    assert np.abs(L_r - slow_bright_pass(levels, slow_counts(levels, span), window)).max() < 1e-3
    # From the fast L_r on: half a level more or less is another place in the histogram.
    expected = (S / np.maximum(L_r, 1e-9) * slow_bilog(L_r.astype(np.float64)) / 255).clip(0, 1)
    assert np.abs(Npe(window, span)(image)[0].numpy() - expected).max() < 1e-4


def test_counts_by_hand() -> None:
    """10 10 20: each 10 has the other beside it, one has the 20; averaged over b, 20 reaches from 16 to 24."""
    levels = np.array([[10, 10, 20]], np.uint8)
    plain = neighbour_counts(levels, 0)
    assert plain.sum() == 4
    assert (plain[10, 10], plain[10, 20], plain[20, 10]) == (2, 1, 1)
    averaged = neighbour_counts(levels, 8)
    assert averaged[10, 16] == averaged[10, 24] == pytest.approx(1 / 9)
    assert averaged[10, 15] == averaged[10, 25] == 0
    # At the ends of the range fewer levels are averaged: 0 to 4 only.
    assert neighbour_counts(np.zeros((1, 2), np.uint8), 8)[0, 0] == pytest.approx(2 / 5)


def test_diagonals_are_neighbours() -> None:
    counts = neighbour_counts(np.array([[1, 2], [3, 4]], np.uint8), 0)
    assert counts[1, 4] == counts[4, 1] == counts[2, 3] == counts[3, 2] == 1
    assert counts.sum() == 12


def test_bright_pass_by_hand() -> None:
    """10 10 20 in one window: (2 * 10 + 2 * 10 + 1 * 20) / (2 + 2 + 1) = 12; nothing is as bright as the 20."""
    levels = np.array([[10, 10, 20]], np.uint8)
    assert bright_pass(levels, neighbour_counts(levels, 0), 15)[0].tolist() == pytest.approx([12, 12, 20], abs=1e-4)


@pytest.mark.parametrize("below", [4, 60, 256])
def test_the_illumination_lies_between_the_picture_and_the_brightest_around(below: int) -> None:
    levels = random_levels(40, 33, below=below)
    L_r = bright_pass(levels, neighbour_counts(levels, 8), 15)
    brightest = torch.nn.functional.max_pool2d(torch.from_numpy(levels.astype(np.float32))[None], 15, 1, 7)[0]
    assert (L_r >= levels).all()
    assert (L_r <= brightest.numpy() + 1e-3).all()


def test_the_mapping_of_an_even_histogram_changes_nothing() -> None:
    """Each level equally often: C = F."""
    L_r = np.arange(256, dtype=np.float32).repeat(3).reshape(16, 48)
    assert np.allclose(bilog(L_r), L_r, atol=1e-3)


def test_the_mapping_is_monotonic_and_reaches_white() -> None:
    L_r = np.sort(np.random.default_rng(0).random(4000) ** 4 * 90).reshape(50, 80)
    L_r.flat[-1] = 90.0
    mapped = bilog(L_r).ravel()
    assert (np.diff(mapped) >= 0).all()
    assert mapped[-1] == 255
    assert np.all((mapped >= 0) & (mapped <= 255))
    # The dark half is spread over many more levels than it had.
    assert mapped[3000] > 1.5 * L_r.ravel()[3000]


def test_colours_keep_their_ratios() -> None:
    image = picture(32, 40)
    result = Npe()(image)
    inside = (result.amax(1) < 1)[0] & (image.amin(1) > 0)[0]
    assert inside.float().mean() > 0.3
    before, after = (one[0] / one[0].amax(0) for one in (image, result))
    assert torch.allclose(before[:, inside], after[:, inside], atol=1e-5)


def test_one_colour_becomes_the_brightest_of_its_hue() -> None:
    """The only level is the last of C, so L_m = 255 and R = S / max S."""
    image = torch.tensor([0.2, 0.4, 0.1])[None, :, None, None].expand(1, 3, 16, 18)
    assert torch.allclose(Npe()(image)[0], torch.tensor([0.5, 1.0, 0.25])[:, None, None].expand(3, 16, 18), atol=1e-4)


@pytest.mark.parametrize("value", [0.0, 1.0])
def test_black_and_white_stay(value: float) -> None:
    image = torch.full((1, 3, 16, 17), value)
    assert torch.allclose(Npe()(image), image, atol=1e-6)


def test_what_is_finer_than_8_bit_stays_in_range() -> None:
    result = Npe()(torch.rand(1, 3, 20, 20, generator=torch.Generator().manual_seed(0)) * 1.4 / 255)
    assert torch.isfinite(result).all()
    assert result.min() >= 0
    assert result.max() <= 1


def test_odd_sizes_and_batches() -> None:
    batch = torch.cat([picture(17, 31), picture(17, 31, 3, below=20)])
    result = Npe()(batch)
    assert result.shape == batch.shape
    for one, alone in zip(result, batch, strict=True):
        assert torch.equal(one, Npe()(alone[None])[0])


@pytest.mark.parametrize("settings", [{"window": 14}, {"window": -1}, {"span": 7}, {"span": -2}, {"span": 256}])
def test_impossible_settings_are_one_sentence(settings: dict) -> None:
    with pytest.raises(UserError, match="npe needs"):
        Npe(**settings)
