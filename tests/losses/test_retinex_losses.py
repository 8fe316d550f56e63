"""Eq. 2-8 against slow transcriptions, hand-made values and finite differences."""

import math

import numpy as np
import pytest
import torch
from kornia.losses import ssim_loss as kornia_ssim_loss
from torch.autograd import gradcheck

from diffnav.errors import UserError
from diffnav.losses.retinex import (
    RetinexLoss,
    brightness_error,
    illumination_smoothness,
    reconstruction,
    reflectance_consistency,
    smoothness_literal,
    smoothness_wei,
    ssim_loss,
)

B, H, W = 2, 7, 9


def images(*channels: int, size: tuple[int, int] = (H, W), seed: int = 0) -> list[torch.Tensor]:
    """Random (B, c, H, W) float64 images in (0, 1), one for each of `channels`."""
    dice = torch.Generator().manual_seed(seed)
    return [torch.rand(B, c, *size, dtype=torch.float64, generator=dice) * 0.9 + 0.05 for c in channels]


def mean_over_pixels(function, *tensors: torch.Tensor) -> float:
    """Mean of function(values of one pixel and channel) by loops; one-channel images repeat."""
    arrays = [t.numpy() for t in tensors]
    values = [
        function(*(a[b, min(c, a.shape[1] - 1), y, x] for a in arrays))
        for b in range(B) for c in range(3) for y in range(arrays[0].shape[2]) for x in range(arrays[0].shape[3])
    ]  # fmt: skip
    return sum(values) / len(values)


def slow_smoothness_wei(illumination: np.ndarray, reflectance: np.ndarray, weight: float) -> float:
    """Wei's smoothness as PAPER.md section 2 words it, pixel by pixel."""
    total = 0.0
    for dy, dx in ((0, 1), (1, 0)):
        terms = []
        for b in range(len(illumination)):
            grey = sum(k * reflectance[b, c] for c, k in enumerate((0.299, 0.587, 0.114)))
            height, width = grey.shape[0] - dy, grey.shape[1] - dx
            for y in range(height):
                for x in range(width):
                    near = [
                        abs(grey[j + dy, i + dx] - grey[j, i])
                        for j in np.clip([y - 1, y, y + 1], 0, height - 1)
                        for i in np.clip([x - 1, x, x + 1], 0, width - 1)
                    ]
                    step = abs(illumination[b, 0, y + dy, x + dx] - illumination[b, 0, y, x])
                    terms.append(step * math.exp(-weight * sum(near) / 9))
        total += sum(terms) / len(terms)
    return total


def slow_ssim(a: np.ndarray, b: np.ndarray) -> float:
    """Mean SSIM of two (H, W) images (Wang et al. 2004): window 11, sigma 1.5, range 1, borders reflected."""
    offsets = range(-5, 6)
    gauss = np.array([[math.exp(-(i * i + j * j) / (2 * 1.5**2)) for i in offsets] for j in offsets])
    gauss /= gauss.sum()
    a_wide, b_wide = np.pad(a, 5, mode="reflect"), np.pad(b, 5, mode="reflect")
    scores = []
    for y in range(a.shape[0]):
        for x in range(a.shape[1]):
            p, q = a_wide[y : y + 11, x : x + 11], b_wide[y : y + 11, x : x + 11]
            mean_p, mean_q = (gauss * p).sum(), (gauss * q).sum()
            var_p, var_q = (gauss * (p - mean_p) ** 2).sum(), (gauss * (q - mean_q) ** 2).sum()
            cov = (gauss * (p - mean_p) * (q - mean_q)).sum()
            top = (2 * mean_p * mean_q + 0.01**2) * (2 * cov + 0.03**2)
            scores.append(top / ((mean_p**2 + mean_q**2 + 0.01**2) * (var_p + var_q + 0.03**2)))
    return float(np.mean(scores))


def test_eq_3_4_and_7_pixel_by_pixel():
    R, I, S, other = images(3, 1, 3, 3)
    assert reconstruction(R, I, S).item() == pytest.approx(mean_over_pixels(lambda r, i, s: (r * i - s) ** 2, R, I, S))
    assert reflectance_consistency(R, other).item() == pytest.approx(
        mean_over_pixels(lambda a, b: (a - b) ** 2, R, other)
    )
    expected = mean_over_pixels(lambda a, b: 0.3 * (a - b) ** 2 + 0.7 * abs(a - b), R, S)
    assert brightness_error(R, S, 0.3, 0.7).item() == pytest.approx(expected)
    expected = mean_over_pixels(lambda a, b: 0.5 * (a - b) ** 2 + 1.5 * abs(a - b), R, S)
    assert brightness_error(R, S).item() == pytest.approx(expected), "the paper's weights"


def test_eq_5_pixel_by_pixel():
    R, I = images(3, 1)
    for weight in (10.0, 2.5):
        expected = slow_smoothness_wei(I.numpy(), R.numpy(), weight)
        assert smoothness_wei(I, R, weight).item() == pytest.approx(expected, rel=1e-9)
        expected = mean_over_pixels(lambda i, r, w=weight: abs(i * math.exp(-w * r)), I, R)
        assert smoothness_literal(I, R, weight).item() == pytest.approx(expected, rel=1e-9)


def test_eq_8_pixel_by_pixel():
    a, b = images(3, 3, size=(12, 13))
    b = (a + 0.3 * b) / 1.3
    expected = np.mean([slow_ssim(a[n, c].numpy(), b[n, c].numpy()) for n in range(B) for c in range(3)])
    assert ssim_loss(a, b).item() == pytest.approx(1 - expected, abs=1e-6)
    assert ssim_loss(a, b).item() == pytest.approx(2 * kornia_ssim_loss(a, b, 11).item(), abs=1e-6)
    assert ssim_loss(a, a).item() == pytest.approx(0, abs=1e-9)


def test_smoothness_by_hand():
    R, I = images(3, 1)
    assert smoothness_wei(torch.full_like(I, 0.3), R).item() == 0, "a constant illumination is smooth for any R"
    step = torch.zeros_like(I)
    step[..., 4:] = 0.6
    flat = torch.full_like(R, 0.5)
    assert smoothness_wei(step, flat).item() == pytest.approx(0.6 / (W - 1))
    rows = torch.zeros_like(I)
    rows[:, :, 3:] = 0.6
    assert smoothness_wei(rows, flat).item() == pytest.approx(0.6 / (H - 1))
    edge = flat.clone()
    edge[..., 4:] = 0.8
    # The edge of height .3 averages to .1 over 3 x 3, so the step counts exp(-10 * .1).
    assert smoothness_wei(step, edge).item() == pytest.approx(0.6 / (W - 1) * math.exp(-1))
    assert smoothness_literal(torch.zeros_like(I), R).item() == 0 < smoothness_literal(I, R).item()


TERMS = {
    "reconstruction": (reconstruction, (3, 1, 3)),
    "reflectance": (reflectance_consistency, (3, 3)),
    "wei": (smoothness_wei, (1, 3)),
    "literal": (smoothness_literal, (1, 3)),
    "brightness": (brightness_error, (3, 3)),
    "ssim": (ssim_loss, (3, 3)),
}


@pytest.mark.parametrize("term", TERMS)
def test_gradients_match_finite_differences(term):
    function, channels = TERMS[term]
    inputs = [t[:1].requires_grad_() for t in images(*channels, size=(6, 7), seed=3)]
    assert gradcheck(function, inputs, eps=1e-7, atol=1e-5)


def extreme_images(channels: int) -> dict[str, torch.Tensor]:
    black = torch.zeros(1, channels, 16, 16)
    two_tone = black.clone()
    two_tone[..., 8:] = 1
    return {"black": black, "flat": black + 0.4, "saturated": black + 1, "two-tone": two_tone}


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("kind", ["black", "flat", "saturated", "two-tone"])
def test_gradients_are_finite_on_extreme_images(term, kind):
    function, channels = TERMS[term]
    for other in ("black", "flat", "saturated", "two-tone"):
        kinds = [kind, *[other] * (len(channels) - 1)]
        inputs = [extreme_images(c)[k].requires_grad_() for c, k in zip(channels, kinds, strict=True)]
        value = function(*inputs)
        value.backward()
        assert value.isfinite()
        assert value >= -1e-6
        assert all(x.grad is not None and x.grad.isfinite().all() and x.grad.abs().max() < 100 for x in inputs)


def test_named_terms_carry_their_weights():
    low, normal, R_low, R_normal, I_low, I_normal, Ih = images(3, 3, 3, 3, 1, 1, 1, size=(12, 12))
    loss = RetinexLoss(2, 3, 5, 7, 11, 13, 17)
    terms = loss.decomposition(low, normal, (R_low, I_low), (R_normal, I_normal))
    smooth = smoothness_wei(I_low, R_low, 7) + smoothness_wei(I_normal, R_normal, 7)
    expected = {
        "reconstruction": 2 * (reconstruction(R_low, I_low, low) + reconstruction(R_normal, I_normal, normal)),
        "reflectance": 3 * reflectance_consistency(R_low, R_normal),
        "illumination": 5 * smooth,
    }
    assert terms.keys() == expected.keys()
    assert all(terms[name].item() == pytest.approx(expected[name].item()) for name in expected)

    terms = loss.enhancement(Ih * R_low, Ih, R_low, normal)
    expected = {
        "brightness": 11 * (Ih * R_low - normal).square().mean() + 13 * (Ih * R_low - normal).abs().mean(),
        "ssim": ssim_loss(Ih * R_low, normal),
        "smoothness": 17 * smoothness_wei(Ih, R_low, 7),
    }
    assert terms.keys() == expected.keys()
    assert all(terms[name].item() == pytest.approx(expected[name].item()) for name in expected)
    assert loss.fidelity(Ih * R_low, normal).keys() == {"brightness", "ssim"}


def test_defaults_are_the_papers_and_tv_is_chosen_by_name():
    paper = RetinexLoss()
    assert (paper.lambda_re, paper.lambda_r, paper.lambda_i) == (0.01, 0.01, 0.01)
    assert (paper.lambda_tv, paper.lambda_re1, paper.lambda_re2, paper.lambda_smooth) == (10, 0.5, 1.5, 1)
    assert illumination_smoothness("wei") is smoothness_wei
    R, Ih, normal = images(3, 1, 3, size=(12, 12))
    smooth = RetinexLoss(tv="literal").enhancement(Ih * R, Ih, R, normal)["smoothness"]
    assert smooth.item() == pytest.approx(smoothness_literal(Ih, R).item())
    with pytest.raises(UserError, match=r"^loss\.tv must be one of wei, literal, got 'tvl1'$"):
        RetinexLoss(tv="tvl1")
