"""The differentiable homography solver: right where points determine a homography, finite everywhere."""

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from kornia.geometry.homography import find_homography_dlt
from torch import Tensor
from torch.autograd import gradcheck

from diffnav.geometry.homography import apply_homography, corners_of, fit_homography
from diffnav.geometry.views import view_homography

SIZE = (96, 128)
CORNERS = corners_of(SIZE)
H_A_B = torch.tensor([[1.1, -0.2, 14.0], [0.3, 0.9, -7.0], [2e-4, -1e-4, 1.0]], dtype=torch.float64)


def scattered(count: int, seed: int = 0) -> Tensor:
    random = torch.rand(1, count, 2, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    return random * torch.tensor([SIZE[1] - 1, SIZE[0] - 1])


def fit(points_a: Tensor, points_b: Tensor, weights: Tensor | None = None):
    return fit_homography(points_a, points_b, torch.ones(points_a.shape[:2]) if weights is None else weights)


def largest_corner_error(H: Tensor, H_true: Tensor) -> float:
    return (apply_homography(H, CORNERS) - apply_homography(H_true, CORNERS)).norm(dim=-1).max().item()


@pytest.mark.parametrize("count", [4, 5, 50])
@pytest.mark.parametrize("angle_deg", [0, 45, 90, 135, 180, 270])
def test_exact_points_give_the_homography(count: int, angle_deg: float) -> None:
    H_true = view_homography(SIZE, math.radians(angle_deg), 1.3, (5.0, -3.0), (0.1, -0.05))
    a = scattered(count, seed=3)
    H, determined = fit(a, apply_homography(H_true, a))
    assert determined.all()
    assert largest_corner_error(H[0], H_true) < 1e-4


def test_weights_are_multiplicities_and_zero_drops_a_pair() -> None:
    a = scattered(8)
    b = apply_homography(H_A_B, a) + torch.randn(a.shape, generator=torch.Generator().manual_seed(1))
    twice = torch.cat([a, a[:, :3]], 1), torch.cat([b, b[:, :3]], 1)
    weighted = fit(a, b, torch.tensor([[2.0, 2, 2, 1, 1, 1, 1, 1]])).H
    torch.testing.assert_close(weighted, fit(*twice).H, rtol=1e-6, atol=1e-8)
    dropped = fit(a, b, torch.tensor([[1.0, 1, 1, 1, 1, 1, 0, 0]])).H
    torch.testing.assert_close(dropped, fit(a[:, :6], b[:, :6]).H, rtol=1e-6, atol=1e-8)


@given(st.floats(1e-6, 1e6))
@settings(max_examples=20)
def test_scaling_all_weights_changes_nothing(factor: float) -> None:
    a = scattered(8)
    b = apply_homography(H_A_B, a) + 1
    weights = torch.rand(1, 8, generator=torch.Generator().manual_seed(2), dtype=torch.float64) + 0.1
    torch.testing.assert_close(fit(a, b, factor * weights).H, fit(a, b, weights).H)


@pytest.mark.parametrize("angle_deg", range(0, 360, 30))
def test_as_accurate_as_the_singular_value_decomposition(angle_deg: float) -> None:
    # 50 points with noise of 1 px, as in a matching: medians over 60 fits, and no outliers among them.
    H_true = view_homography(SIZE, math.radians(angle_deg), 1.0, (4.0, 2.0), (0.05, 0.1))
    dice = torch.Generator().manual_seed(angle_deg)
    a = torch.rand(60, 50, 2, generator=dice, dtype=torch.float64) * torch.tensor([127, 95])
    b = apply_homography(H_true, a) + torch.randn(60, 50, 2, generator=dice, dtype=torch.float64)
    ours = fit(a, b).H
    theirs = find_homography_dlt(a, b, torch.ones(60, 50, dtype=torch.float64), solver="svd")
    errors = [
        torch.tensor([largest_corner_error(H, H_true) for H in found], dtype=torch.float64) for found in (ours, theirs)
    ]
    assert errors[0].median() < 1.05 * errors[1].median()
    assert (errors[0] < 1.5 * errors[1] + 0.5).all()


@pytest.mark.parametrize("noise_px", [0.0, 1.0])
@pytest.mark.parametrize("points", ["corners", "scattered"])
def test_gradients_are_those_of_finite_differences(points: str, noise_px: float) -> None:
    # At exact correspondences and at axis-aligned corners too, where other solvers give NaN or wrong ones.
    a = CORNERS[None] if points == "corners" else scattered(7)
    dice = torch.Generator().manual_seed(0)
    b = apply_homography(H_A_B, a) + noise_px * torch.randn(a.shape, generator=dice, dtype=torch.float64)
    weights = 0.2 + torch.rand(a.shape[:2], generator=dice, dtype=torch.float64)
    inputs = tuple(x.clone().requires_grad_() for x in (a, b, weights))
    assert gradcheck(lambda *x: apply_homography(fit_homography(*x).H, CORNERS), inputs, rtol=1e-4, atol=1e-4)


DEGENERATE = {
    "collinear": (torch.stack([torch.arange(6.0), 2 * torch.arange(6.0) + 1], 1), None, False),
    "coincident": (torch.full((6, 2), 7.0), None, False),
    "zero weights": (scattered(6)[0], torch.zeros(6), False),
    "three points": (scattered(3)[0], None, False),
    "three with weight": (scattered(6)[0], torch.tensor([1.0, 1, 1, 0, 0, 0]), False),
    "one point": (scattered(1)[0], None, False),
    "axis-aligned": (CORNERS, None, True),
    "all but one collinear": (torch.tensor([[0.0, 0], [10, 0], [20, 0], [30, 0], [5, 9]]), None, False),
}


@pytest.mark.parametrize("name", DEGENERATE)
@pytest.mark.parametrize("moved", [True, False], ids=["moved", "flat"])
def test_finite_in_value_and_gradient_whatever_the_points(name: str, moved: bool) -> None:
    points, weights, sound = DEGENERATE[name]
    a = points[None].double().requires_grad_()
    # "flat": every point finds the same place, as descriptors of a black or flat picture do.
    target = apply_homography(H_A_B, points[None]) if moved else torch.full((1, len(points), 2), 50.0)
    b = target.double().requires_grad_()
    w = (torch.ones(len(points)) if weights is None else weights)[None].double().requires_grad_()
    H, determined = fit_homography(a, b, w)
    assert determined.item() == (sound and moved)
    error = (apply_homography(H, CORNERS) - apply_homography(H_A_B, CORNERS)).square().sum().clamp(max=1e4)
    error.backward()
    for tensor in (H, a.grad, b.grad, w.grad):
        assert tensor is not None
        assert torch.isfinite(tensor).all()


def test_half_outliers_stay_finite_and_weights_can_silence_them() -> None:
    a = scattered(20)
    b = apply_homography(H_A_B, a)
    b[:, 10:] = scattered(10, seed=9)
    b.requires_grad_()
    H, _ = fit(a, b)
    H.square().sum().backward()
    assert torch.isfinite(H).all()
    assert torch.isfinite(b.grad).all()
    silenced = torch.cat([torch.ones(1, 10), torch.zeros(1, 10)], 1)
    assert largest_corner_error(fit(a, b.detach(), silenced).H[0], H_A_B) < 1e-4


def test_undetermined_fits_keep_centre_and_spread() -> None:
    a = torch.tensor([[[0.0, 0], [2, 0]]])
    H, determined = fit(a, torch.tensor([[[10.0, 10], [10, 14]]]))
    assert not determined
    torch.testing.assert_close(
        apply_homography(H[0], torch.tensor([[1.0, 0]])), torch.tensor([[10.0, 12]], dtype=torch.float64)
    )
