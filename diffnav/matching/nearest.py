"""Nearest neighbours among descriptors: ratio test, mutual check, and each position counted once."""

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.matching.hamming import two_nearest_hamming
from diffnav.matching.matches import Features, Matches

# Rows of the distance matrix computed at a time: 10,000 descriptors then need 80 MB, not 400.
_ROWS = 2_000


def nearest_settings(features: int, ratio: float, mutual: bool) -> dict[str, Any]:
    """The settings of a matcher that takes the nearest, by name. Raises: UserError naming one out of range."""
    require_count(features)
    if not isinstance(ratio, int | float) or not 0 < ratio <= 1:
        raise UserError(f"matcher.ratio must be above 0 and at most 1, got {ratio}")
    if not isinstance(mutual, bool):
        raise UserError(f"matcher.mutual must be true or false, got {mutual}")
    return {"features": features, "ratio": ratio, "mutual": mutual}


def require_count(features: int) -> None:
    """Raise UserError unless `features` is a whole number from 1 on."""
    if not isinstance(features, int) or features < 1:
        raise UserError(f"matcher.features must be a whole number, 1 or more, got {features}")


def match_nearest(a: Features, b: Features, matcher: str, settings: Mapping[str, Any]) -> Matches:
    """Each a's nearest b that passes the ratio test and the mutual check of `settings`, each position counted once."""
    indices, confidence = nearest_neighbours(a.descriptors, b.descriptors, settings["ratio"], settings["mutual"])
    indices, confidence = count_positions_once(a, b, indices, confidence)
    return matches_at(a, b, indices, confidence, matcher, settings)


def matches_at(
    a: Features, b: Features, indices: Tensor, confidence: Tensor, matcher: str, settings: Mapping[str, Any]
) -> Matches:
    """The points of a and b at `indices` (M, 2) as `Matches`; confidence (M,)."""
    return Matches(a.keypoints[indices[:, 0]], b.keypoints[indices[:, 1]], confidence, matcher, settings)


def nearest_neighbours(
    descriptors_a: Tensor, descriptors_b: Tensor, ratio: float = 1.0, mutual: bool = True
) -> tuple[Tensor, Tensor]:
    """Indices (M, 2) of each a's nearest b, and the confidences (M,) = 1 - d1 / d2 in [0, 1].

    Args:
        descriptors_a, descriptors_b: (N, D), (K, D), compared by Euclidean distance, or by Hamming distance if they
            are binary (uint8, 8 bits each).
        ratio: kept where d1 < ratio * d2, the distances to the nearest and the second nearest b (Lowe 2004);
            1 or more tests nothing.
        mutual: kept where a is also b's nearest.
    With fewer than two candidates nothing shows that the nearest is meant: the ratio test then keeps none.
    """
    needed = 2 if ratio < 1 else 1
    if len(descriptors_a) == 0 or len(descriptors_b) < needed:
        nothing = descriptors_a.new_zeros(0, dtype=torch.float32)
        return nothing.new_zeros((0, 2), dtype=torch.long), nothing
    nearest, first, second, back = _both_ways(descriptors_a, descriptors_b)
    keep = first < ratio * second if ratio < 1 else torch.ones_like(first, dtype=torch.bool)
    if mutual:
        keep &= back[nearest] == torch.arange(len(nearest), device=nearest.device)
    # Two candidates at distance 0 are as ambiguous as two at any other equal distance.
    confidence = torch.where(second > 0, 1 - first / second.clamp(min=torch.finfo(second.dtype).tiny), 0.0)
    indices = torch.stack([torch.arange(len(nearest), device=nearest.device), nearest], 1)
    return indices[keep], confidence[keep].clamp(0, 1)


def count_positions_once(a: Features, b: Features, indices: Tensor, confidence: Tensor) -> tuple[Tensor, Tensor]:
    """The given matches without those whose pixel in a or in b a more confident match already uses.

    Several orientations of one keypoint must not count as several matches, nor one corner found at several scales a
    fraction of a pixel apart. They are dropped here, not before matching: which orientation comes first differs
    between two images, and the wrong ones would not match.

    Args: indices (M, 2) into a and b; confidence (M,). Returns: the same for the M' <= M kept, most confident first.
    """
    order = confidence.argsort(descending=True, stable=True)
    points = torch.cat([a.keypoints[indices[:, 0]], b.keypoints[indices[:, 1]]], 1).round().tolist()
    used_a, used_b = set(), set()
    kept = []
    for i in order.tolist():
        xa, ya, xb, yb = points[i]
        if (xa, ya) not in used_a and (xb, yb) not in used_b:
            used_a.add((xa, ya))
            used_b.add((xb, yb))
            kept.append(i)
    return indices[kept], confidence[kept]


def _both_ways(descriptors_a: Tensor, descriptors_b: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """(index of the nearest b, its distance, the second nearest's), each (N,), and (K,) each b's nearest a.

    Of equally near ones the first; the second distance is infinite where there is no second.
    """
    if descriptors_a.dtype == torch.uint8:
        return *two_nearest_hamming(descriptors_a, descriptors_b), two_nearest_hamming(descriptors_b, descriptors_a)[0]
    parts = []
    best = descriptors_b.new_full((len(descriptors_b),), torch.inf)
    back = torch.zeros_like(best, dtype=torch.long)
    for start, rows in zip(range(0, len(descriptors_a), _ROWS), descriptors_a.split(_ROWS), strict=True):
        distances = torch.cdist(rows, descriptors_b)
        near, which = distances.min(0)
        back = torch.where(near < best, which + start, back)
        best = torch.minimum(near, best)
        first, nearest = distances.min(1)
        second = distances.scatter_(1, nearest[:, None], torch.inf).min(1).values
        parts.append((nearest, first, second))
    nearest, first, second = (torch.cat(column) for column in zip(*parts, strict=True))
    return nearest, first, second, back
