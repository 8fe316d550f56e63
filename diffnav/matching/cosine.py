"""Mutual nearest neighbours among descriptors of length 1, kept where they are similar enough."""

from collections.abc import Mapping
from typing import Any

from diffnav.errors import UserError
from diffnav.matching.matches import Features, Matches
from diffnav.matching.nearest import count_positions_once, matches_at, nearest_neighbours


def require_cosine(min_cosine: float) -> None:
    """Raise UserError for a bound that is no cosine."""
    if not -1 <= min_cosine <= 1:
        raise UserError(f"matcher.min_cosine must be in [-1, 1], got {min_cosine}")


def match_by_cosine(a: Features, b: Features, min_cosine: float, matcher: str, settings: Mapping[str, Any]) -> Matches:
    """Matches whose descriptors are each other's nearest and have a cosine above `min_cosine`, positions once.

    Descriptors have length 1; the confidence is their cosine, 0 where it is negative. -1 bounds nothing.
    """
    indices, _ = nearest_neighbours(a.descriptors, b.descriptors, ratio=1, mutual=True)
    cosine = (a.descriptors[indices[:, 0]] * b.descriptors[indices[:, 1]]).sum(1)
    keep = cosine > min_cosine
    indices, confidence = count_positions_once(a, b, indices[keep], cosine[keep].clamp(0, 1))
    return matches_at(a, b, indices, confidence, matcher, settings)
