"""Mutual nearest neighbours by cosine, by hand."""

import math

import pytest
import torch

from diffnav.errors import UserError
from diffnav.matching.cosine import match_by_cosine, require_cosine
from diffnav.matching.matches import Features


def at_angles(degrees, keypoints=None):
    """Features whose descriptors are unit vectors in the plane; the n-th lies at (10 n, 5 n) unless told."""
    angles = torch.tensor(degrees, dtype=torch.float64).deg2rad()
    points = torch.tensor(keypoints or [[10 * n, 5 * n] for n in range(len(degrees))], dtype=torch.float32)
    descriptors = torch.stack([angles.cos(), angles.sin()], 1).float()
    return Features(points, descriptors, torch.ones(len(degrees)), (100, 100))


def test_mutual_similar_and_most_confident_first():
    # 0 -> 20 (b0), but b0's nearest is 25; 25 -> b0; 90 -> 100 (b1); 180 -> 140 (b2), both ways.
    a, b = at_angles([0, 25, 90, 180]), at_angles([20, 100, 140])
    matches = match_by_cosine(a, b, 0.5, "by hand", {"min_cosine": 0.5})
    assert matches.points_a.tolist() == [[10, 5], [20, 10], [30, 15]]
    assert matches.points_b.tolist() == [[0, 0], [10, 5], [20, 10]]
    expected = [math.cos(math.radians(angle)) for angle in (5, 10, 40)]
    assert matches.confidence.tolist() == pytest.approx(expected, abs=1e-6)
    assert (matches.matcher, matches.settings) == ("by hand", {"min_cosine": 0.5})
    assert len(match_by_cosine(a, b, 0.8, "", {})) == 2
    assert len(match_by_cosine(a, b, 0.99, "", {})) == 1


def test_without_a_bound_opposite_descriptors_match_with_no_confidence():
    matches = match_by_cosine(at_angles([0]), at_angles([170]), -1, "", {})
    assert matches.confidence.tolist() == [0]
    assert len(match_by_cosine(at_angles([0]), at_angles([170]), 0, "", {})) == 0


def test_a_position_is_counted_once():
    a = at_angles([0, 90], keypoints=[[5, 5], [5, 5]])
    matches = match_by_cosine(a, at_angles([10, 92]), -1, "", {})
    assert matches.points_b.tolist() == [[10, 5]]


@pytest.mark.parametrize("min_cosine", [-1.1, 1.01, float("nan")])
def test_a_bound_that_is_no_cosine_is_named(min_cosine):
    with pytest.raises(UserError, match=r"matcher\.min_cosine"):
        require_cosine(min_cosine)
