"""The features of a map's tiles: tile by tile, and those of any window, each place once."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from made_maps import picture_map

from diffnav.data.maps.geo_map import Window
from diffnav.navigation.map_features import MapFeatures
from diffnav.navigation.tiles import tile_windows

SIZE = (150, 220)


def features_of(windows: list[Window], places: np.ndarray, **differs: object) -> MapFeatures:
    """Every tile finds each place that lies on it; the descriptors number the places, the scores the findings."""
    found = []
    for top, left, height, width in windows:
        inside = (places >= [left - 0.5, top - 0.5]) & (places < [left + width - 0.5, top + height - 0.5])
        found.append(np.flatnonzero(inside.all(1)))
    numbers = np.concatenate(found)
    facts: dict = {
        "map": picture_map(torch.zeros(3, *SIZE)),
        "windows": tuple(windows),
        "offsets": np.cumsum([0, *map(len, found)]),
        "keypoints": places[numbers].astype(np.float32),
        "descriptors": numbers[:, None].astype(np.float32),
        "scores": np.arange(len(numbers)).astype(np.float32),
        "numbers": False,
    }
    return MapFeatures(**(facts | differs))  # type: ignore[arg-type]


def places_at(seed: int) -> np.ndarray:
    """Some anywhere, some at whole pixels and just beside the edges at which tiles of 50 x 55 meet."""
    dice = np.random.default_rng(seed)
    anywhere = dice.uniform([-0.49, -0.49], [SIZE[1] - 0.51, SIZE[0] - 0.51], (150, 2))
    whole = dice.integers([0, 0], [SIZE[1], SIZE[0]], (150, 2)).astype(float)
    edges = [
        (x + d, y + e) for x in (55, 110, 165) for y in (50, 100) for d in (-0.7, -0.3, 0) for e in (-0.6, -0.2, 0)
    ]
    # Two in one pixel are one place.
    kept = {(math.floor(x + 0.5), math.floor(y + 0.5)): (x, y) for x, y in [*anywhere, *whole, *edges]}
    return np.array(list(kept.values()))


@settings(max_examples=40, deadline=None)
@given(
    data=st.data(),
    overlap=st.sampled_from([0.0, 0.1, 0.33, 0.5, 0.8]),
    tile_size=st.sampled_from([(50, 55), (64, 40), (150, 220), (33, 90)]),
    seed=st.integers(0, 5),
)
def test_a_window_has_each_place_once(
    data: st.DataObject, overlap: float, tile_size: tuple[int, int], seed: int
) -> None:
    top, left = data.draw(st.integers(0, SIZE[0] - 1)), data.draw(st.integers(0, SIZE[1] - 1))
    window = (top, left, data.draw(st.integers(1, SIZE[0] - top)), data.draw(st.integers(1, SIZE[1] - left)))
    places = places_at(seed)
    found = features_of(tile_windows(SIZE, tile_size, overlap), places).within(window)
    expected = {
        number: (x - left, y - top)
        for number, (x, y) in enumerate(places.tolist())
        if left - 0.5 <= x < left + window[3] - 0.5 and top - 0.5 <= y < top + window[2] - 0.5
    }
    numbers = found.descriptors[:, 0].long().tolist()
    assert sorted(numbers) == sorted(expected)
    assert found.size == window[2:]
    for number, point in zip(numbers, found.keypoints.tolist(), strict=True):
        assert point == pytest.approx(expected[number], abs=1e-4)


def test_where_tiles_overlap_the_tile_that_sees_more_around_a_place_counts() -> None:
    """Tiles from 0 to 99 and from 50 to 149: what lies left of 74.5 is nearer to the middle of the first."""
    windows = [(0, 0, 40, 100), (0, 50, 40, 100)]
    places = np.array([[60.0, 20.0], [74.3, 20], [74.7, 20], [90, 20]])
    features = features_of(windows, places)
    assert features.within((0, 0, 40, 150)).scores.tolist() == [0, 1, 6, 7]


def test_a_tile_has_all_of_its_own() -> None:
    windows = tile_windows(SIZE, (50, 55), 0.5)
    places = places_at(0)
    features = features_of(windows, places)
    for k, (top, left, height, width) in enumerate(windows):
        tile = features.tile(k)
        numbers = tile.descriptors[:, 0].long()
        assert tile.size == (height, width)
        assert torch.allclose(tile.keypoints.double(), torch.from_numpy(places[numbers] - [left, top]), atol=1e-4)
        start, end = features.offsets[k], features.offsets[k + 1]
        assert tile.scores.tolist() == list(range(start, end))


def test_numbers_become_float_and_bits_stay() -> None:
    places = np.array([[1.0, 2.0], [3, 4]])
    stored = np.array([[0, 255], [7, 8]], np.uint8)
    windows = tile_windows(SIZE, SIZE)
    for numbers, dtype in ((True, torch.float32), (False, torch.uint8)):
        features = features_of(windows, places, descriptors=stored, numbers=numbers)
        for found in (features.tile(0), features.within((0, 0, 10, 10))):
            assert found.descriptors.dtype == dtype
            assert found.descriptors.tolist() == [[0, 255], [7, 8]]
            found.descriptors.zero_()
    assert stored.sum() > 0, "what was handed out was no copy"


def test_nothing_is_an_answer() -> None:
    empty = features_of(tile_windows(SIZE, (50, 55)), np.zeros((0, 2)))
    far = features_of(tile_windows(SIZE, (50, 55)), np.array([[200.0, 100.0]]))
    for found in (empty.tile(3), empty.within((0, 0, 60, 60)), far.within((0, 0, 60, 60)), far.tile(0)):
        assert len(found) == 0
        assert found.keypoints.shape == (0, 2)
        assert found.descriptors.shape == (0, 1)
    assert len(far.within((0, 0, *SIZE))) == 1


def test_size_is_what_the_arrays_hold() -> None:
    features = features_of([(0, 0, *SIZE)], np.array([[1.0, 2.0], [3, 4]]))
    # Two offsets of 8 bytes; two features of 2 + 1 + 1 numbers of 4.
    assert features.size_bytes == 2 * 8 + 2 * 4 * 4
