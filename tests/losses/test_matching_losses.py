"""The matcher-aware terms against slow transcriptions, by gradcheck, and on pictures that show nothing."""

import math

import numpy as np
import pytest
import torch
from torch import Tensor
from torch.autograd import gradcheck

from diffnav.geometry.views import view_homography
from diffnav.losses.matching import detector_loss, homography_loss, match_loss, structure_loss

SIZE = (20, 24)


def picture(seed: int, batch: int = 2, size: tuple[int, int] = SIZE) -> Tensor:
    return torch.rand(batch, 3, *size, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def slow_correlation(a: np.ndarray, b: np.ndarray, sigma: float, emphasis: float) -> float:
    """Weighted mean of the local correlation of two grey pictures; edges are mirrored about the last pixel."""
    reach = int(3 * sigma + 0.5)
    window = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    window = np.outer(window, window) / np.outer(window, window).sum()
    values, weights = [], []
    for y in range(a.shape[0]):
        for x in range(a.shape[1]):
            rows = [abs(r) if r < a.shape[0] else 2 * a.shape[0] - 2 - r for r in range(y - reach, y + reach + 1)]
            columns = [abs(c) if c < a.shape[1] else 2 * a.shape[1] - 2 - c for c in range(x - reach, x + reach + 1)]
            p, q = a[np.ix_(rows, columns)], b[np.ix_(rows, columns)]
            mean_p, mean_q = (window * p).sum(), (window * q).sum()
            covariance = (window * (p - mean_p) * (q - mean_q)).sum()
            variance_p, variance_q = (window * (p - mean_p) ** 2).sum(), (window * (q - mean_q) ** 2).sum()
            values.append((covariance + 1e-4) / math.sqrt((variance_p + 1e-4) * (variance_q + 1e-4)))
            weights.append(math.sqrt(variance_q + 1e-4) ** emphasis)
    return float(np.average(values, weights=weights))


@pytest.mark.parametrize("emphasis", [0.0, 1.0, 2.0])
def test_structure_is_the_local_correlation_of_grey_values(emphasis: float) -> None:
    a, b = picture(0, 1), picture(1, 1)
    b = 0.5 * a + 0.5 * b
    b[..., :8] = 0.3 + 0.2 * b[..., :8]
    grey = [(x[0] * x.new_tensor([0.299, 0.587, 0.114])[:, None, None]).sum(0).numpy() for x in (a, b)]
    expected = np.mean([1 - slow_correlation(*grey, sigma, emphasis) for sigma in (1.0, 2.5)])
    assert structure_loss(a, b, (1.0, 2.5), emphasis).item() == pytest.approx(expected, abs=1e-6)


def test_structure_does_not_see_gain_and_offset_but_sees_detail() -> None:
    a = picture(0)
    # The small constant that keeps flat places finite weighs a little.
    assert structure_loss(0.4 * a + 0.3, a) < 0.01
    assert structure_loss(1 - a, a) > 1.9
    assert structure_loss(picture(1), a) > 0.5


def test_flat_agrees_with_flat_and_everything_is_finite() -> None:
    for left in (0.0, 0.5, 1.0):
        enhanced = torch.full((1, 3, *SIZE), left, requires_grad=True)
        assert structure_loss(enhanced, torch.zeros(1, 3, *SIZE)).item() == pytest.approx(0, abs=1e-3)
        loss = structure_loss(enhanced, picture(0, 1).float())
        loss.backward()
        assert torch.isfinite(loss)
        assert torch.isfinite(enhanced.grad).all()


def slow_detector(a: Tensor, b: Tensor) -> float:
    total, count = 0.0, 0
    for n in range(a.shape[0]):
        for s in range(a.shape[1]):
            p, q = a[n, s].numpy(), b[n, s].numpy()
            p, q = p / (np.abs(p).mean() + 1e-4), q / (np.abs(q).mean() + 1e-4)
            total, count = total + np.abs(p - q).sum(), count + p.size
    return total / count


def test_detector_compares_responses_of_mean_magnitude_one() -> None:
    a, b = (torch.randn(2, 3, 5, 6, generator=torch.Generator().manual_seed(s), dtype=torch.float64) for s in (0, 1))
    assert detector_loss(a, b).item() == pytest.approx(slow_detector(a, b))
    assert detector_loss(100 * b, b).item() == pytest.approx(0, abs=1e-3)


def test_match_is_the_mean_over_valid_points_of_minus_log_of_their_own() -> None:
    log_P = torch.log(torch.tensor([[[0.5, 0.1], [0.3, 0.25]], [[0.9, 0.2], [0.1, 0.01]]]))
    valid = torch.tensor([[True, True], [True, False]])
    expected = -(math.log(0.5) + math.log(0.25) + math.log(0.9)) / 3
    assert match_loss(log_P, valid).item() == pytest.approx(expected)
    assert match_loss(log_P, torch.zeros_like(valid)).item() == 0


def test_homography_is_the_huber_corner_error() -> None:
    H = view_homography(SIZE, 0.3, 1.1)
    shift = torch.tensor([[1.0, 0, 3], [0, 1, -4], [0, 0, 1]], dtype=torch.float64)
    small = torch.tensor([[1.0, 0, 0.6], [0, 1, 0], [0, 0, 1]], dtype=torch.float64)
    estimated = torch.stack([shift @ H, small @ H, 1000 * shift @ H])
    usable = torch.tensor([True, True, False])
    # All corners move by 5 px, then by .6 px: Huber gives 5 - .5 and .6^2 / 2.
    expected = (4.5 + 0.18) / 2
    assert homography_loss(estimated, H.expand(3, 3, 3), usable, SIZE).item() == pytest.approx(expected, abs=1e-6)
    far = torch.tensor([[1.0, 0, 500], [0, 1, 0], [0, 0, 1]], dtype=torch.float64)[None] @ H
    assert homography_loss(far, H[None], torch.tensor([True]), SIZE).item() == pytest.approx(30)
    assert homography_loss(far, H[None], torch.tensor([False]), SIZE).item() == 0


def test_a_perfect_homography_has_no_gradient_and_no_nan() -> None:
    H = view_homography(SIZE, 0.3, 1.1)[None]
    estimated = H.clone().requires_grad_()
    homography_loss(estimated, H, torch.tensor([True]), SIZE).backward()
    assert torch.isfinite(estimated.grad).all()
    assert estimated.grad.abs().max() < 1e-3


def test_gradients_are_those_of_finite_differences() -> None:
    a, b = picture(3, 1, (8, 9)).requires_grad_(), picture(4, 1, (8, 9))
    assert gradcheck(lambda x: structure_loss(x, b, (1.0, 2.0)), (a,))
    responses = torch.randn(1, 2, 4, 5, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    assert gradcheck(lambda x: detector_loss(x, responses.flip(2)), (responses.clone().requires_grad_(),))
    log_P = torch.randn(2, 3, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(1)).requires_grad_()
    assert gradcheck(lambda x: match_loss(x, torch.tensor([[True, True, False]] * 2)), (log_P,))
    H = view_homography(SIZE, 0.3, 1.1)[None]
    near = (H + 0.01).requires_grad_()
    assert gradcheck(lambda x: homography_loss(x, H, torch.tensor([True]), SIZE), (near,))
