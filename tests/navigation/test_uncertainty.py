"""How sure a place is: the covariance against what repeated measurements really scatter."""

import pytest
import torch
from torch import Tensor

from diffnav.geometry.homography import apply_homography, fit_homography
from diffnav.navigation.uncertainty import point_covariance

SIZE = torch.tensor([600.0, 400.0], dtype=torch.float64)


def points_of(count: int, seed: int) -> Tensor:
    return torch.rand(count, 2, generator=torch.Generator().manual_seed(seed), dtype=torch.float64) * SIZE


def least_squares(points_a: Tensor, points_b: Tensor) -> Tensor:
    """(B, 3, 3): from the algebraic fit, three steps of Gauss-Newton on the distances in b, derivatives by hand."""
    H = fit_homography(points_a, points_b, torch.ones(points_a.shape[:2])).H
    H = H / H[:, 2:, 2:]
    for _ in range(3):
        x, y = points_a.unbind(-1)
        one, none = torch.ones_like(x), torch.zeros_like(x)
        mapped = apply_homography(H, points_a)
        u, v = mapped.unbind(-1)
        w = H[:, 2:, 0] * x + H[:, 2:, 1] * y + 1
        rows_u = torch.stack([x, y, one, none, none, none, -u * x, -u * y], -1) / w[..., None]
        rows_v = torch.stack([none, none, none, x, y, one, -v * x, -v * y], -1) / w[..., None]
        J = torch.cat([rows_u, rows_v], 1)
        r = torch.cat([points_b[..., 0] - u, points_b[..., 1] - v], 1)
        # Columns of one size: sums of squares of pixels beside those of ones.
        size = J.square().sum(1, keepdim=True).sqrt()
        step = torch.linalg.lstsq(J / size, r[..., None], driver="gelsd").solution[..., 0] / size[:, 0]
        H = (H.reshape(-1, 9) + torch.cat([step, torch.zeros_like(step[:, :1])], 1)).reshape(-1, 3, 3)
    return H


@pytest.mark.parametrize(
    ("H", "place", "count"),
    [
        ([[1, 0, 50], [0, 1, 20], [0, 0, 1]], (300, 200), 40),
        ([[0.4, -0.7, 500], [0.7, 0.4, 80], [0, 0, 1]], (300, 200), 40),
        ([[1.1, 0.1, 50], [-0.1, 0.8, 20], [3e-4, -2e-4, 1]], (300, 200), 30),
        # Far from the middle of the points, and of few of them.
        ([[1.1, 0.1, 50], [-0.1, 0.8, 20], [3e-4, -2e-4, 1]], (580, 10), 30),
        ([[1, 0.2, 50], [0, 1, 20], [0, 1e-4, 1]], (100, 300), 12),
    ],
    ids=["shift", "turn", "tilt", "corner", "few"],
)
def test_the_covariance_is_that_of_many_fits(H: list, place: tuple[float, float], count: int) -> None:
    """3,000 times the points are measured anew, with an error of .8 px along each axis, and fitted."""
    trials, sigma = 3000, 0.8
    H_true = torch.tensor(H, dtype=torch.float64)
    points_a, there = points_of(count, 1), torch.tensor(place, dtype=torch.float64)
    exact = apply_homography(H_true, points_a)
    dice = torch.Generator().manual_seed(2)
    measured = exact + sigma * torch.randn(trials, count, 2, generator=dice, dtype=torch.float64)
    fits = least_squares(points_a.expand(trials, -1, -1), measured)
    places = apply_homography(fits, there.expand(trials, 1, 2))[:, 0]
    scatter = torch.cov(places.T)
    # Each trial estimates its own noise; in the mean over trials the noise is right.
    told = torch.stack([point_covariance(fits[k], points_a, measured[k], there) for k in range(0, trials, 20)]).mean(0)
    assert told.trace().item() == pytest.approx(scatter.trace().item(), rel=0.1)
    assert (told - scatter).abs().max() < 0.1 * scatter.diagonal().max()


def test_twice_the_noise_is_four_times_the_covariance() -> None:
    points_a, place = points_of(25, 3), SIZE / 2
    error = torch.randn(25, 2, generator=torch.Generator().manual_seed(4), dtype=torch.float64)
    once, twice = (point_covariance(torch.eye(3), points_a, points_a + k * error, place) for k in (1, 2))
    assert torch.allclose(twice, 4 * once, rtol=1e-6)
    assert torch.allclose(once, once.T)


def test_the_scale_of_h_and_the_place_of_the_frame_do_not_matter() -> None:
    points_a = points_of(25, 3)
    error = torch.randn(25, 2, generator=torch.Generator().manual_seed(4), dtype=torch.float64)
    H = torch.tensor([[1.1, 0.1, 50], [-0.1, 0.8, 20], [3e-4, -2e-4, 1]], dtype=torch.float64)
    points_b = apply_homography(H, points_a) + error
    plain = point_covariance(H, points_a, points_b, SIZE / 2)
    assert torch.allclose(point_covariance(-7 * H, points_a, points_b, SIZE / 2), plain, rtol=1e-6)
    shift = torch.tensor([[1, 0, 9000], [0, 1, 70000], [0, 0, 1]], dtype=torch.float64)
    moved = points_b + torch.tensor([9000.0, 70000])
    assert torch.allclose(point_covariance(shift @ H, points_a, moved, SIZE / 2), plain, rtol=1e-4)


def test_a_place_far_from_the_points_is_less_sure() -> None:
    """Points in the left quarter say little of the right edge; almost on a line, little of what is beside it."""
    points_a = points_of(40, 5) * torch.tensor([0.25, 1])
    error = 0.5 * torch.randn(40, 2, generator=torch.Generator().manual_seed(6), dtype=torch.float64)
    near, far = (
        point_covariance(torch.eye(3), points_a, points_a + error, torch.tensor([x, 200.0])).trace() for x in (75, 590)
    )
    assert far > 100 * near
    line = torch.stack([points_a[:, 1], 0.5 * points_a[:, 1] + 0.01 * points_a[:, 0]], 1)
    beside = point_covariance(torch.eye(3), line, line + error, torch.tensor([100.0, 350]))
    assert beside.trace().sqrt() > 100
    exactly = torch.stack([line[:, 0], 0.5 * line[:, 0]], 1)
    unknown = point_covariance(torch.eye(3), exactly, exactly + error, torch.tensor([100.0, 350]))
    assert unknown.trace().sqrt() > 1000


def test_exact_points_leave_no_doubt() -> None:
    points_a = points_of(10, 7)
    assert point_covariance(torch.eye(3), points_a, points_a, SIZE / 2).abs().max() < 1e-12
