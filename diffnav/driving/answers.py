"""From matches with each reference to the answer: most matches, as in the paper, or most that geometry accepts."""

from collections.abc import Mapping, Sequence


def most_matches(counts: Sequence[int]) -> int | None:
    """The reference with the most matches, the first of several; None where nothing matched."""
    best = max(range(len(counts)), key=lambda k: (counts[k], -k), default=None)
    return None if best is None or counts[best] <= 0 else best


def most_accepted(counts: Sequence[int], accepted: Mapping[int, int]) -> int | None:
    """Of the references whose matches were verified, the one with the most accepted, then the most of all.

    accepted: reference -> matches that geometry accepts. None where none has any.
    """
    best = max(accepted, key=lambda k: (accepted[k], counts[k], -k), default=None)
    return None if best is None or accepted[best] <= 0 else best


def candidates(counts: Sequence[int], count: int) -> list[int]:
    """At most `count` references that matched, those with the most matches first, the earlier of equals before."""
    ranked = sorted(range(len(counts)), key=lambda k: (-counts[k], k))
    return [k for k in ranked[:count] if counts[k] > 0]
