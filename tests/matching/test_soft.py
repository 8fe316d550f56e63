"""Soft matches: the dual softmax against its definition, its exclusions, and the points that follow from it."""

import math

import pytest
import torch
from torch import Tensor
from torch.autograd import gradcheck

from diffnav.matching.soft import dual_softmax, not_alternatives, soft_correspondences


def directions(seed: int, count: int = 4) -> Tensor:
    x = torch.randn(1, count, 6, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    return x / x.norm(dim=2, keepdim=True)


def slow_dual_softmax(a: Tensor, b: Tensor, temperature: float) -> list[list[float]]:
    dots = [[sum(x * y for x, y in zip(p, q, strict=True)) for q in b.tolist()] for p in a.tolist()]
    S = [[math.exp(dot / temperature) for dot in row] for row in dots]
    rows, columns = [sum(row) for row in S], [sum(column) for column in zip(*S, strict=True)]
    return [[s / rows[i] * s / columns[j] for j, s in enumerate(row)] for i, row in enumerate(S)]


def test_equals_the_definition() -> None:
    a, b = directions(0), directions(1, 5)
    expected = torch.tensor(slow_dual_softmax(a[0], b[0], 0.2), dtype=torch.float64)
    torch.testing.assert_close(dual_softmax(a, b, 0.2).exp()[0], expected)


def test_swapping_the_pictures_transposes() -> None:
    a, b = directions(0), directions(1, 5)
    torch.testing.assert_close(dual_softmax(a, b).mT, dual_softmax(b, a))


def test_what_is_excluded_competes_with_nobody() -> None:
    a, b = directions(0), directions(1)
    excluded = torch.zeros(1, 4, 4, dtype=torch.bool)
    excluded[0, 3, :3] = excluded[0, :3, 3] = True
    alone = dual_softmax(a[:, :3], b[:, :3])
    torch.testing.assert_close(dual_softmax(a, b, excluded=excluded)[:, :3, :3], alone)


def test_close_and_invalid_points_are_no_alternatives() -> None:
    points = torch.tensor([[[0.0, 0], [2, 2], [3, 0], [50, 50]]])
    valid = torch.tensor([[True, True, True, False]])
    expected = [[0, 1, 0, 1], [1, 0, 1, 1], [0, 1, 0, 1], [1, 1, 1, 0]]
    assert not_alternatives(points, valid, 3.0)[0].int().tolist() == expected


def test_points_follow_the_largest_share() -> None:
    P = torch.tensor([[[0.89, 0.01], [0.15, 0.15]]])
    points = torch.tensor([[[10.0, 0], [20, 40]]])
    found = soft_correspondences(P.log(), points)
    torch.testing.assert_close(found.points[0], torch.tensor([[10 + 10 / 90, 40 / 90], [15.0, 20]]))
    torch.testing.assert_close(found.confidence[0], torch.tensor([0.9, 0.3]))


@pytest.mark.parametrize("same", [True, False])
def test_gradients_are_those_of_finite_differences(same: bool) -> None:
    a = directions(0).requires_grad_()
    b = (directions(0) if same else directions(1)).requires_grad_()
    points = torch.rand(1, 4, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    assert gradcheck(dual_softmax, (a, b))
    assert gradcheck(lambda p, q: soft_correspondences(dual_softmax(p, q), points), (a, b))


def test_equal_descriptors_of_a_flat_picture_stay_finite() -> None:
    a = torch.full((1, 3, 4), 0.5, requires_grad=True)
    log_P = dual_softmax(a, a.detach(), 0.01)
    log_P.sum().backward()
    torch.testing.assert_close(log_P.exp(), torch.full((1, 3, 3), 1 / 9))
    assert torch.isfinite(a.grad).all()
