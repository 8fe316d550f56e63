"""Votes for tiles and the exact search behind them, against slow transcriptions."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch
from made_maps import placed_features

from diffnav.matching.matches import Features
from diffnav.navigation import shortlist
from diffnav.navigation.shortlist import ExactIndex, Shortlist, joined_offsets


def query_of(descriptors: np.ndarray) -> Features:
    count = len(descriptors)
    return Features(torch.zeros(count, 2), torch.from_numpy(descriptors), torch.ones(count), (10, 10))


def slow_votes(
    query: np.ndarray, stored: np.ndarray, tile_of: Sequence[int], tiles: int, neighbours: int
) -> np.ndarray:
    """McCann & Lowe 2012, algorithm 2, with totals of distances that are subtracted from the background's."""
    totals = np.zeros(tiles)
    for descriptor in query.astype(float):
        distances = [float(((descriptor - other) ** 2).sum()) for other in stored.astype(float)]
        nearest = sorted(range(len(stored)), key=lambda row: distances[row])
        background = distances[nearest[neighbours]]
        for tile in range(tiles):
            own = [distances[row] for row in nearest[:neighbours] if tile_of[row] == tile]
            if own:
                totals[tile] -= min(own) - background
    return totals


@pytest.mark.parametrize("neighbours", [1, 3, 10])
@pytest.mark.parametrize("seed", [0, 1])
def test_votes_are_those_of_the_algorithm(neighbours: int, seed: int) -> None:
    """Nine tiles, two of them empty, of two maps."""
    dice = np.random.default_rng(seed)
    lengths = [6, 0, 9, 4, 12, 3, 8, 0, 5]
    stored = dice.uniform(0, 1, (sum(lengths), 5)).astype(np.float32)
    query = dice.uniform(0, 1, (20, 5)).astype(np.float32)
    offsets = np.cumsum([0, *lengths])
    searched = Shortlist(offsets, ExactIndex([stored[:19], stored[19:]], bits=False), neighbours)
    tile_of = [tile for tile, length in enumerate(lengths) for _ in range(length)]
    expected = slow_votes(query, stored, tile_of, 9, neighbours)
    assert searched.votes(query_of(query)) == pytest.approx(expected, abs=1e-5)
    order = sorted(range(9), key=lambda tile: (-expected[tile], tile))
    assert searched.best(query_of(query), 4).tolist() == order[:4]
    allowed = [7, 2, 5, 8]
    expected_order = sorted(allowed, key=lambda tile: (-expected[tile], allowed.index(tile)))
    assert searched.best(query_of(query), 3, np.array(allowed)).tolist() == expected_order[:3]


def test_the_tile_that_shows_the_query_wins() -> None:
    dice = np.random.default_rng(4)
    stored = dice.integers(0, 256, (400, 32)).astype(np.uint8)
    query = stored[120:140] ^ (1 << dice.integers(0, 8, (20, 32))).astype(np.uint8)
    offsets = np.arange(0, 401, 20)
    assert Shortlist(offsets, ExactIndex([stored], bits=True)).best(query_of(query), 1).tolist() == [6]


def test_few_descriptors_and_none() -> None:
    """Where there are fewer than asked for, the farthest is the background: finite votes, the nearest's tile first."""
    stored = np.array([[0.0], [3.0], [10.0]], np.float32)
    searched = Shortlist(np.array([0, 1, 2, 3]), ExactIndex([stored], bits=False), neighbours=10)
    assert searched.votes(query_of(np.array([[2.0]], np.float32))).tolist() == [60, 63, 0]
    assert searched.votes(query_of(np.zeros((0, 1), np.float32))).tolist() == [0, 0, 0]
    nothing = Shortlist(np.array([0, 0, 0]), ExactIndex([stored[:0]], bits=False))
    assert nothing.votes(query_of(np.array([[2.0]], np.float32))).tolist() == [0, 0]
    assert nothing.best(query_of(np.array([[2.0]], np.float32)), 5).tolist() == [0, 1]


def all_distances(query: np.ndarray, stored: np.ndarray, bits: bool) -> np.ndarray:
    """Squared Euclidean distances, or numbers of bits that differ, one by one."""
    table = np.zeros((len(query), len(stored)))
    for i, a in enumerate(query.tolist()):
        for j, b in enumerate(stored.tolist()):
            table[i, j] = sum((x ^ y).bit_count() if bits else (x - y) ** 2 for x, y in zip(a, b, strict=True))
    return table


@pytest.mark.parametrize("kind", ["float", "numbers", "bits"])
@pytest.mark.parametrize("block", [7, 50])
def test_the_index_finds_the_nearest_across_blocks_and_maps(
    kind: str, block: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shortlist, "_BLOCK", block)
    dice = np.random.default_rng(2)
    stored = dice.integers(0, 256, (60, 4)).astype(np.uint8)
    query = dice.integers(0, 256, (9, 4)).astype(np.uint8)
    if kind != "bits":
        query = query.astype(np.float32)
    if kind == "float":
        stored = (stored / 7).astype(np.float32)
    parts = [stored[:23], stored[23:23], stored[23:26], stored[26:]]
    distances, rows = ExactIndex(parts, kind == "bits").search(torch.from_numpy(query), 8)
    table = all_distances(query, stored, kind == "bits")
    # Rows may differ where distances are equal.
    assert distances == pytest.approx(np.sort(table, 1)[:, :8], rel=1e-5, abs=0.02)
    assert np.take_along_axis(table, rows, 1) == pytest.approx(distances, rel=1e-5, abs=0.02)
    assert all(len(set(row)) == 8 for row in rows.tolist())


def test_none_stands_where_there_are_too_few() -> None:
    stored = np.array([[1.0], [5.0]], np.float32)
    distances, rows = ExactIndex([stored], bits=False).search(torch.tensor([[4.0]]), 4)
    assert rows.tolist() == [[1, 0, -1, -1]]
    assert distances[0].tolist() == [1, 9, np.inf, np.inf]


def test_offsets_run_on_from_map_to_map() -> None:
    one = placed_features([(1, 1), (2, 2), (3, 3)])
    cut = replace(one, windows=one.windows * 2, offsets=np.array([0, 1, 3]))
    assert joined_offsets([cut, placed_features([]), one]).tolist() == [0, 1, 3, 3, 6]
