"""From matches with each reference to the answer: most matches, as in the paper, or most inliers."""

from collections.abc import Mapping, Sequence


def most_matches(counts: Sequence[int]) -> int | None:
    """The reference with the most matches, the first of several; None where nothing matched."""
    best = max(range(len(counts)), key=lambda k: (counts[k], -k), default=None)
    return None if best is None or counts[best] <= 0 else best


def most_inliers(counts: Sequence[int], inliers: Mapping[int, int]) -> int | None:
    """Of the references whose matches were verified, the one with the most inliers, then the most matches.

    inliers: reference -> matches that a model explains. None where none has an inlier.
    """
    best = max(inliers, key=lambda k: (inliers[k], counts[k], -k), default=None)
    return None if best is None or inliers[best] <= 0 else best


def candidates(counts: Sequence[int], count: int) -> list[int]:
    """At most `count` references that matched, those with the most matches first, the earlier of equals before."""
    ranked = sorted(range(len(counts)), key=lambda k: (-counts[k], k))
    return [k for k in ranked[:count] if counts[k] > 0]
