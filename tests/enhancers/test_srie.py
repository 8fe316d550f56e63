"""SRIE against its formulas in dense algebra, and what holds for it whatever the picture."""

import colorsys

import numpy as np
import pytest
import torch
from torch import Tensor

from diffnav.enhancers.srie import Srie, shrink
from diffnav.errors import UserError


def dark_picture(size: tuple[int, int] = (16, 18), batch: int = 1, seed: int = 0) -> Tensor:
    """Coloured blocks under a slope of light, 8 bit, a few black pixels."""
    dice = torch.Generator().manual_seed(seed)
    blocks = torch.rand(batch, 3, -(-size[0] // 4), -(-size[1] // 4), generator=dice)
    blocks = blocks.repeat_interleave(4, 2).repeat_interleave(4, 3)[..., : size[0], : size[1]]
    light = torch.linspace(0.05, 0.7, size[1])
    return (255 * (blocks * light + 0.01 * torch.rand(batch, 3, *size, generator=dice))).round() / 255


def differences(height: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """D_x and D_y as matrices, a zero row where there is no neighbour."""
    along_x, along_y = (np.zeros((height * width, height * width)) for _ in range(2))
    for y in range(height):
        for x in range(width):
            p = y * width + x
            if x + 1 < width:
                along_x[p, p], along_x[p, p + 1] = -1, 1
            if y + 1 < height:
                along_y[p, p], along_y[p, p + width] = -1, 1
    return along_x, along_y


def slow_decompose(value: np.ndarray, iterations: int, c1: float, c2: float, penalty: float) -> list[tuple]:
    """PAPER 9 with dense matrices in float64: (R, L, relative changes) after each iteration."""
    D = np.vstack(differences(*value.shape))
    s = np.log(np.maximum(value.astype(np.float64), 1)).ravel()
    r, l, b = np.zeros_like(s), s.copy(), np.zeros(2 * s.size)
    found = []
    for _ in range(iterations):
        R, L = np.exp(r), np.exp(l)
        R2, L2 = np.diag(np.tile(R, 2)), np.diag(np.tile(L, 2))
        slope = R2 @ D @ r + b
        d = np.array([np.sign(v) * max(abs(v) - 1 / (2 * penalty), 0) for v in slope])
        left = np.eye(s.size) + c1 * penalty * D.T @ R2 @ R2 @ D
        r = np.minimum(np.linalg.solve(left, s - l + c1 * penalty * D.T @ R2 @ (d - b)), 0)
        b = b + R2 @ D @ r - d
        l = np.maximum(np.linalg.solve(np.eye(s.size) + c2 * D.T @ L2 @ L2 @ D, s - r), s)
        changes = [np.linalg.norm(np.exp(a) - c) / np.linalg.norm(c) for a, c in ((r, R), (l, L))]
        found.append((np.exp(r).reshape(value.shape), np.exp(l).reshape(value.shape), *changes))
    return found


@pytest.mark.parametrize(("c1", "c2", "penalty"), [(0.01, 0.1, 1.0), (0.5, 0.02, 3.0)])
def test_the_decomposition_is_that_of_the_formulas(c1: float, c2: float, penalty: float) -> None:
    """The second setting makes the terms of the reflectance count: d and b are no longer zero."""
    value = 255 * dark_picture()[0].max(0).values.numpy()
    expected = slow_decompose(value, 6, c1, c2, penalty)
    for iterations in (1, 2, 6):
        srie = Srie(c1, c2, penalty, tolerance=0, iterations=iterations, solver_tolerance=1e-6)
        parts = srie.decompose(value)
        R, L, *changes = expected[iterations - 1]
        assert parts.iterations == iterations
        assert np.allclose(parts.R, R, atol=1e-3)
        assert np.allclose(parts.L, L, rtol=1e-3)
        assert parts.change == pytest.approx(max(changes), rel=0.02)
        assert parts.R.dtype == np.float32


def test_the_iterations_stop_at_the_relative_change() -> None:
    value = 255 * dark_picture()[0].max(0).values.numpy()
    expected = slow_decompose(value, 30, 0.01, 0.1, 1.0)
    first = next(k for k, (*_, change_R, change_L) in enumerate(expected, 1) if max(change_R, change_L) <= 0.02)
    assert 2 < first < 30
    assert Srie(tolerance=0.02, solver_tolerance=1e-6).decompose(value).iterations == first
    bounded = Srie(tolerance=1e-9, iterations=4).decompose(value)
    assert bounded.iterations == 4
    assert bounded.change > 1e-9


def test_the_default_solver_tolerance_costs_less_than_a_level() -> None:
    image = dark_picture((60, 90))
    rough, exact = Srie()(image), Srie(solver_tolerance=1e-6)(image)
    assert 255 * (rough - exact).abs().max() < 1


def test_bounds_of_the_two_parts() -> None:
    value = 255 * dark_picture((40, 51))[0].max(0).values.numpy()
    parts = Srie().decompose(value)
    assert parts.R.max() <= 1
    assert (parts.L / np.maximum(value, 1)).min() > 1 - 1e-6
    # They rebuild the value but for what the small weight c1 smooths away.
    assert np.abs(parts.R * parts.L / np.maximum(value, 1) - 1).mean() < 0.02


def test_the_result_is_hsv_with_a_new_value() -> None:
    image = dark_picture((20, 23))
    parts = Srie().decompose(255 * image[0].max(0).values.numpy())
    result = Srie()(image)[0]
    for y in range(20):
        for x in range(23):
            hue, saturation, _ = colorsys.rgb_to_hsv(*image[0, :, y, x].tolist())
            bright = float(parts.R[y, x]) * (float(parts.L[y, x]) / 255) ** (1 / 2.2)
            expected = colorsys.hsv_to_rgb(hue, saturation, min(bright, 1))
            assert result[:, y, x].tolist() == pytest.approx(expected, abs=2e-5)


def test_shrink_by_hand() -> None:
    assert shrink(np.array([-2.0, -0.5, 0.0, 0.4, 0.9]), 0.5) == pytest.approx([-1.5, 0, 0, 0, 0.4])


def test_a_flat_picture_is_all_illumination() -> None:
    """R = 1 and L = V: the root with exponent 1 / 2.2, monotonic, the same everywhere; black counts as level 1."""
    for level, expected in ((0, (1 / 255) ** (1 / 2.2)), (40, (40 / 255) ** (1 / 2.2)), (255, 1.0)):
        result = Srie()(torch.full((1, 3, 17, 31), level / 255))
        assert torch.allclose(result, torch.tensor(expected), atol=1e-4)


def test_a_dark_picture_gets_brighter() -> None:
    image = dark_picture((48, 64))
    result = Srie()(image)
    assert (result.max(1).values >= image.max(1).values - 1e-4).all()
    assert result.mean() > 1.3 * image.mean()


@pytest.mark.parametrize("size", [(16, 16), (17, 33), (41, 16)])
def test_odd_sizes_and_a_batch_as_its_pictures(size: tuple[int, int]) -> None:
    image = dark_picture(size, batch=2)
    image[1] = image[1].flip(-1)
    result = Srie()(image)
    assert result.shape == image.shape
    assert torch.equal(result, torch.cat([Srie()(image[:1]), Srie()(image[1:])]))


def test_hard_edges_stay_finite() -> None:
    image = torch.zeros(1, 3, 20, 30)
    image[..., 11:] = 1
    result = Srie()(image)
    assert torch.isfinite(result).all()
    assert 0 <= result.min() <= result.max() <= 1


@pytest.mark.parametrize(
    "arguments",
    [
        {"c1": -1},
        {"c2": -0.1},
        {"penalty": 0},
        {"gamma": 0.5},
        {"tolerance": -1},
        {"iterations": 0},
        {"solver_tolerance": 0},
        {"c1": float("nan")},
    ],
)
def test_a_setting_that_srie_cannot_use_is_one_sentence(arguments: dict) -> None:
    with pytest.raises(UserError, match="srie needs"):
        Srie(**arguments)
