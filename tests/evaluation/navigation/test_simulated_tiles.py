"""Simulated tiles: a slow transcription, their likeness to the real ones, and what they may not be made of."""

import numpy as np
import pytest
import torch

from diffnav.errors import UserError
from diffnav.evaluation.navigation.simulated_tiles import Pool, make_pool, resemblance, simulated_tiles
from diffnav.matching.matches import Features

WINDOWS = [(10 * row, 20 * column, 10, 20) for row in range(4) for column in range(6)]


def tile_of(descriptors: np.ndarray) -> Features:
    count = len(descriptors)
    scores = torch.linspace(1, 0.1, count) if count else torch.zeros(0)
    return Features(torch.zeros(count, 2), torch.from_numpy(descriptors.astype(np.float32)), scores, (10, 20))


def real_tiles(count: int, features: int = 30, seed: int = 0, width: int = 8) -> list[Features]:
    """Descriptors that crowd, as real ones do, each of length 512 but for rounding."""
    dice = np.random.default_rng(seed)
    kinds = dice.uniform(0, 1, (10, width)) ** 2
    tiles = []
    for _ in range(count):
        values = kinds[dice.integers(0, 10, features)] + dice.uniform(0, 0.4, (features, width))
        tiles.append(tile_of((512 * values / np.linalg.norm(values, axis=1, keepdims=True) / 2).round()))
    return tiles


def slow_neighbours(tiles: list[Features], tile: int, descriptor: np.ndarray) -> list[list[float]]:
    """The 8 descriptors of other tiles that are nearest to one of this tile."""
    others = [other for k, one in enumerate(tiles) if k != tile for other in one.descriptors.double().tolist()]
    return sorted(others, key=lambda other: sum((a - b) ** 2 for a, b in zip(other, descriptor, strict=True)))[:8]


def test_neighbours_are_the_nearest_of_other_places() -> None:
    tiles = [*real_tiles(5), tile_of(np.zeros((0, 8)))]
    pool = make_pool(tiles)
    assert len(pool) == 5, "a tile without features is no model"
    for row in (0, 29, 30, 100, 149):
        descriptor = pool.descriptors[row]
        distances = [np.linalg.norm(pool.descriptors[k] - descriptor) for k in pool.neighbours[row]]
        expected = [np.linalg.norm(np.array(o) - descriptor) for o in slow_neighbours(tiles, row // 30, descriptor)]
        assert distances == pytest.approx(expected, rel=1e-4)
        assert (pool.neighbours[row] // 30 != row // 30).all()


def test_a_tile_is_its_model_moved_along_the_ways_to_neighbours() -> None:
    """Here each descriptor has one neighbour, eight times over: on the way to it the third number stays."""
    descriptors = np.array([[200.0, 140, 100], [140, 200, 100]], np.float32)
    pool = Pool(descriptors, np.array([0.5, 0.4], np.float32), np.array([0, 1, 2]), np.array([[1] * 8, [0] * 8]))
    shares = []
    for seed in range(400):
        (moved,), (score,) = pool.tile(np.random.default_rng(seed))
        assert np.linalg.norm(moved) == pytest.approx(np.linalg.norm(descriptors[0]), rel=1e-5)
        model = 0 if score == np.float32(0.5) else 1
        before = moved * 100 / moved[2]
        assert before.sum() == pytest.approx(440, rel=1e-5)
        shares.append(float(200 - before[model]) / 60)
    # The sum of four normal steps of .35 has a deviation of .7; 2.3 would be needed to reach 0.
    assert np.mean(shares) == pytest.approx(0, abs=0.12)
    assert np.std(shares) == pytest.approx(0.7, abs=0.08)


def test_tiles_are_like_the_models_and_none_is_another() -> None:
    pool = make_pool(real_tiles(6))
    tiles = list(simulated_tiles(pool, WINDOWS, seed=3))
    assert len(tiles) == 24
    seen = np.concatenate([tile["descriptors"] for tile in tiles])
    assert len(np.unique(seen, axis=0)) == len(seen)
    assert not any((pool.descriptors == one).all(1).any() for one in seen)
    for (top, left, height, width), tile in zip(WINDOWS, tiles, strict=True):
        assert [tile[name].dtype for name in ("keypoints", "descriptors", "scores")] == ["float32", "uint8", "float32"]
        assert len(tile["keypoints"]) == len(tile["descriptors"]) == len(tile["scores"]) == 30
        x, y = tile["keypoints"].T
        assert left <= x.min() <= x.max() <= left + width - 1
        assert top <= y.min() <= y.max() <= top + height - 1
        assert (np.diff(tile["scores"]) < 0).all(), "strongest first, as in the pool"
        assert np.linalg.norm(tile["descriptors"], axis=1) == pytest.approx(256, rel=0.02)
    lefts = [left for _, left, _, _ in WINDOWS]
    columns = np.concatenate([(tile["keypoints"][:, 0] - left) / 19 for left, tile in zip(lefts, tiles, strict=True)])
    assert np.histogram(columns, 4, (0, 1))[0] == pytest.approx([180] * 4, abs=50)


def test_a_tile_depends_on_the_seed_and_its_number_alone() -> None:
    pool = make_pool(real_tiles(6))
    few, many = (list(simulated_tiles(pool, WINDOWS[:count], 3)) for count in (5, 24))
    other = list(simulated_tiles(pool, WINDOWS[:5], 4))
    for k in range(5):
        assert all((few[k][name] == many[k][name]).all() for name in few[k])
        assert not (few[k]["descriptors"] == other[k]["descriptors"]).all()


def test_simulated_tiles_are_about_as_near_as_real_ones() -> None:
    """Were they copies, or noise of every direction, it would tell."""
    tiles = real_tiles(40, width=16)
    found = resemblance(tiles, 0)
    assert found["tiles"] == 20
    asking = torch.cat([tile.descriptors for tile in tiles[::2]])
    among = torch.cat([tile.descriptors for tile in tiles[1::2]])
    nearest = [min(float((one - other).norm()) for other in among) for one in asking[::20]]
    assert found["real"] == pytest.approx(np.median(nearest), rel=0.1)
    assert found["simulated"] == pytest.approx(found["real"], rel=0.15)


def test_nothing_can_be_made_of_bits_or_of_too_little() -> None:
    bits = [Features(t.keypoints, t.descriptors.byte(), t.scores, t.size) for t in real_tiles(4)]
    with pytest.raises(UserError, match="descriptors of numbers, not of bits; use matcher=sift"):
        make_pool(bits)
    flat = tile_of(np.zeros((0, 8)))
    for few in ([flat, flat], [*real_tiles(1), flat], [*real_tiles(1), *real_tiles(1, 7)]):
        with pytest.raises(UserError, match=r"maps\.pool: \d tiles with features are too few"):
            make_pool(few)
