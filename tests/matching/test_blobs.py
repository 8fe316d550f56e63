"""Differences of Gaussians and their extrema, against hand-made blobs and a slow search."""

import math

import numpy as np
import torch
from torch import Tensor
from torch.autograd import gradcheck

from diffnav.blur import blur
from diffnav.matching.blobs import dog_responses, strongest_blobs

SIGMAS = (1.6, 2.0, 2.5, 3.2)


def with_blob(x: int, y: int, sigma: float, size: tuple[int, int] = (64, 72)) -> Tensor:
    rows, columns = np.mgrid[: size[0], : size[1]]
    blob = np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * sigma**2))
    return torch.from_numpy(0.2 + 0.6 * blob).float().expand(1, 3, *size)


def test_a_gaussian_blob_is_blurred_as_theory_says() -> None:
    """A Gaussian of s under one of t is one of sqrt(s^2 + t^2), its height in the same ratio squared."""
    image = with_blob(36, 32, 3.0)
    height = blur(image, 2.0)[0, 0, 32, 36].item()
    assert abs(height - (0.2 + 0.6 * 9 / 13)) < 2e-3


def test_responses_peak_at_the_blob_and_at_its_scale() -> None:
    for sigma, best in ((1.9, 0), (3.6, 3)):
        image = with_blob(30, 33, sigma)
        responses = dog_responses(image, SIGMAS)
        assert responses.shape == (1, 4, 64, 72)
        blobs = strongest_blobs(responses, SIGMAS, 5)
        assert blobs.frames[0, 0, :, 2].tolist() == [30, 33]
        assert math.isclose(blobs.frames[0, 0, 0, 0].item(), 6 * SIGMAS[best], rel_tol=1e-6)
        # A bright blob on a dark ground: the wider Gaussian is lower there.
        assert responses[0, best, 33, 30] < 0


def slow_extrema(responses: np.ndarray) -> set[tuple[int, int, int]]:
    found, magnitude = set(), np.abs(responses)
    scales, height, width = magnitude.shape
    for s in range(scales):
        radius = 6 * SIGMAS[s]
        for y in range(height):
            for x in range(width):
                around = magnitude[max(s - 1, 0) : s + 2, max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
                edge = min(x, y, width - 1 - x, height - 1 - y)
                if magnitude[s, y, x] == around.max() and edge >= radius:
                    found.add((s, y, x))
    return found


def test_finds_every_extremum_inside_the_strongest_first() -> None:
    image = torch.rand(1, 3, 60, 64, generator=torch.Generator().manual_seed(0))
    responses = dog_responses(image, SIGMAS)
    blobs = strongest_blobs(responses, SIGMAS, 400)
    found = [
        (SIGMAS.index(min(SIGMAS, key=lambda s: abs(6 * s - f[0, 0].item()))), int(f[1, 2]), int(f[0, 2]))
        for f, valid in zip(blobs.frames[0], blobs.valid[0], strict=True)
        if valid
    ]
    assert set(found) == slow_extrema(responses[0].numpy())
    strengths = [abs(responses[0][place].item()) for place in found]
    assert strengths == sorted(strengths, reverse=True)


def test_a_flat_picture_has_none() -> None:
    blobs = strongest_blobs(dog_responses(torch.zeros(2, 3, 48, 48), SIGMAS), SIGMAS, 8)
    assert blobs.frames.shape == (2, 8, 2, 3)
    assert not blobs.valid.any()


def test_gradients_are_those_of_finite_differences() -> None:
    image = torch.rand(1, 3, 10, 9, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    assert gradcheck(lambda x: dog_responses(x, (1.0, 1.5)), (image.requires_grad_(),))
