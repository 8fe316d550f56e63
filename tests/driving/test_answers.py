"""Who wins among the references, by hand and against a sorted list."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from diffnav.driving.answers import candidates, most_accepted, most_matches

# -1: left out by a shortlist.
counts_of = st.lists(st.integers(-1, 4), max_size=8)


def test_most_matches_win_and_the_first_of_equals() -> None:
    assert most_matches([3, 7, 7, 1]) == 1
    assert most_matches([0, -1, 2]) == 2


def test_nothing_matched_is_no_answer() -> None:
    assert most_matches([]) is None
    assert most_matches([0, 0]) is None
    assert most_matches([-1, 0, -1]) is None


def test_most_accepted_win_then_matches_then_the_first() -> None:
    assert most_accepted([9, 8, 7], {0: 3, 1: 5, 2: 4}) == 1
    assert most_accepted([8, 9, 9], {0: 5, 1: 5, 2: 5}) == 1
    # A reference that was not verified cannot win, however many matches it has.
    assert most_accepted([99, 8, 7], {2: 1, 1: 0}) == 2


def test_no_inliers_are_no_answer() -> None:
    assert most_accepted([9, 8], {}) is None
    assert most_accepted([9, 8], {0: 0, 1: 0}) is None


def test_candidates_by_hand() -> None:
    assert candidates([2, 9, 0, 9, -1, 5], 3) == [1, 3, 5]
    assert candidates([2, 9, 0, 9, -1, 5], 99) == [1, 3, 5, 0]
    assert candidates([2, 9], 0) == []
    assert candidates([0, -1], 2) == []


@given(counts_of, st.integers(0, 9))
def test_candidates_begin_with_the_winner(counts: list[int], count: int) -> None:
    found = candidates(counts, count)
    assert found[:1] == ([] if count == 0 or most_matches(counts) is None else [most_matches(counts)])
    assert len(found) == len(set(found)) == min(count, sum(own > 0 for own in counts))
    left = [k for k, own in enumerate(counts) if own > 0 and k not in found]
    for a, b in pairwise(found):
        assert (counts[a], -a) > (counts[b], -b)
    assert all((counts[a], -a) > (counts[b], -b) for a in found for b in left)


@given(counts_of)
def test_equal_inliers_are_ranked_by_matches(counts: list[int]) -> None:
    verified = dict.fromkeys(candidates(counts, 5), 3)
    assert most_accepted(counts, verified) == most_matches(counts)
