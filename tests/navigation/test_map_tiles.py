"""How maps are cut into tiles."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from diffnav.errors import UserError
from diffnav.navigation.tiles import tile_windows


def test_the_papers_maps_are_cut_into_nine() -> None:
    expected = [(top, left, 1200, 2400) for top in (0, 1200, 2400) for left in (0, 2400, 4800)]
    assert tile_windows((3600, 7200), (1200, 2400)) == expected


def test_a_map_smaller_than_a_tile_is_one_tile() -> None:
    assert tile_windows((50, 70), (1200, 2400), 0.5) == [(0, 0, 50, 70)]
    assert tile_windows((50, 100), (64, 64), 0.25) == [(0, 0, 50, 64), (0, 36, 50, 64)]


def test_half_a_pixel_of_overlap_is_not_lost() -> None:
    """Half of 33 pixels are 16.5: tiles that begin 17 apart would overlap by less."""
    lefts = [window[1] for window in tile_windows((33, 66), (33, 33), 0.5)]
    assert lefts[0] == 0
    assert lefts[-1] == 33
    assert max(b - a for a, b in pairwise(lefts)) <= 16


@given(
    map_size=st.tuples(st.integers(1, 900), st.integers(1, 900)),
    tile_size=st.tuples(st.integers(32, 400), st.integers(32, 400)),
    overlap=st.floats(0, 0.95),
)
def test_tiles_cover_the_map_and_overlap_as_asked(
    map_size: tuple[int, int], tile_size: tuple[int, int], overlap: float
) -> None:
    windows = tile_windows(map_size, tile_size, overlap)
    assert len(set(windows)) == len(windows)
    assert windows == sorted(windows)
    rows, columns = ({(window[axis], window[axis + 2]) for window in windows} for axis in (0, 1))
    assert {(row[0], column[0]) for row in rows for column in columns} == {window[:2] for window in windows}
    for spans, length, side in zip((rows, columns), map_size, tile_size, strict=True):
        starts = sorted(start for start, _ in spans)
        (extent,) = {extent for _, extent in spans}
        assert extent == min(side, length)
        assert starts[0] == 0
        assert starts[-1] + extent == length
        # No two tiles closer than a pixel, no gap wider than a whole tile less its overlap.
        assert all(0 < b - a <= max(1, extent * (1 - overlap) + 1e-6) for a, b in pairwise(starts))


@given(st.integers(32, 200), st.integers(32, 900), st.floats(0, 0.9))
def test_no_more_tiles_than_needed(side: int, length: int, overlap: float) -> None:
    """One tile less, spread evenly, would overlap by less than a whole pixel of what was asked."""
    count = len(tile_windows((side, length), (side, side), overlap))
    if count > 2:
        gap = (length - min(side, length)) / (count - 2)
        assert gap > int(side * (1 - overlap) + 1e-6)


@pytest.mark.parametrize(
    ("size", "overlap", "message"),
    [
        ((31, 100), 0.0, r"tiles.size must be \[height, width\] in pixels, each 32 or more, got \[31, 100\]"),
        ((100, 100, 3), 0.0, "tiles.size"),
        ((100.0, 100), 0.0, "tiles.size"),
        ((100, 100), 1.0, r"tiles.overlap must be in \[0, 1\), got 1.0"),
        ((100, 100), -0.1, "tiles.overlap"),
        ((100, 100), float("nan"), "tiles.overlap"),
    ],
)
def test_settings_out_of_range_are_named(size: tuple, overlap: float, message: str) -> None:
    with pytest.raises(UserError, match=message):
        tile_windows((500, 500), size, overlap)
