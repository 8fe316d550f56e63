"""Soft matches: the differentiable side of matching, from descriptors to corresponding points with confidences."""

from typing import NamedTuple

import torch
from torch import Tensor

# In place of minus infinity: its exponential is 0 in float32, and its gradient no NaN.
_EXCLUDED = -1e4


class SoftPoints(NamedTuple):
    """points (B, K, 2): where each point of a is found in b, pixels; confidence (B, K) in [0, 1]."""

    points: Tensor
    confidence: Tensor


def dual_softmax(
    descriptors_a: Tensor, descriptors_b: Tensor, temperature: float = 0.1, excluded: Tensor | None = None
) -> Tensor:
    """log P, (B, K, L), of P = softmax over rows x softmax over columns of a b^T / temperature.

    Args:
        descriptors_a, descriptors_b: (B, K, D) and (B, L, D), of length 1. temperature: > 0; small ones decide hard.
        excluded: (B, K, L) bool, pairs that are no alternatives of any other.
    Returns: values <= 0, differentiable in both descriptors. Source: Rocco et al. 2018; Sun et al. 2021, eq. 2.
    """
    S = descriptors_a @ descriptors_b.mT / temperature
    if excluded is not None:
        S = S.masked_fill(excluded, _EXCLUDED)
    return S.log_softmax(2) + S.log_softmax(1)


def not_alternatives(points: Tensor, valid: Tensor, radius_px: float = 3.0) -> Tensor:
    """(B, K, K) bool: pairs (i, j), i != j, of points that are closer than `radius_px` or of which one is not valid.

    Points so close are one point: neither is a wrong match of the other. Args: points (B, K, 2); valid (B, K) bool.
    """
    close = torch.cdist(points, points, compute_mode="donot_use_mm_for_euclid_dist") < radius_px
    unusable = ~(valid[:, :, None] & valid[:, None, :])
    same = torch.eye(points.shape[1], dtype=torch.bool, device=points.device)
    return (close | unusable) & ~same


def soft_correspondences(log_P: Tensor, points_b: Tensor) -> SoftPoints:
    """Where the points of a lie in b: the mean of b's points, (B, L, 2), under P's rows; their sum is the confidence.

    Args: log_P (B, K, L), of `dual_softmax`. Differentiable in both.
    """
    share = log_P.softmax(2).to(points_b.dtype)
    return SoftPoints(share @ points_b, log_P.exp().sum(2).clamp(max=1))
