"""Tiles of distant places that nobody drew: features made of those of real tiles, for maps of any number of tiles."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from diffnav.data.maps.geo_map import Window
from diffnav.errors import UserError
from diffnav.matching.matches import Features
from diffnav.navigation.feature_store import TileArrays

# Of each real descriptor, among those of other places; how many of them are mixed into it, and how much of each.
_NEIGHBOURS, _MIXED, _SHARE = 8, 4, 0.35
# What simulated tiles depend on besides the pool and the seed, and that in words.
RECIPE = ("mixed neighbours", _NEIGHBOURS, _MIXED, _SHARE)
IN_WORDS = (
    f"each simulated tile is a real one of another place whose descriptors a went a step w (b - a) to each of {_MIXED} "
    f"of their {_NEIGHBOURS} nearest b in other places, w normal with deviation {_SHARE}, and kept their lengths; "
    "keypoints lie evenly. The deviation was chosen so that the nearest descriptor among simulated tiles is as far as "
    "among real ones"
)
# Descriptors of a place that are compared for `resemblance`.
_PROBES = 50


@dataclass(frozen=True)
class Pool:
    """Descriptors of real tiles, all of different places, and what simulated tiles are made of them.

    descriptors: (N, D) float32, tile after tile, the strongest first; scores: (N,). offsets: (P + 1,) where each tile's
    begin. neighbours: (N, 8) rows of the nearest descriptors of other tiles.
    """

    descriptors: np.ndarray
    scores: np.ndarray
    offsets: np.ndarray
    neighbours: np.ndarray

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def tile(self, dice: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Descriptors (n, D) float32 and scores (n,) of one simulated tile, which is like one of the real ones.

        Each descriptor a of that tile goes a step w (b - a) towards, or away from, each of 4 neighbours b in other
        places, w normal with deviation .35, and keeps its length. What one place shows stays together, no two tiles
        are equal, and simulated tiles are as easily confused as real ones: of the embedded world's SIFT descriptors the
        nearest in 10, 22, 60 and 220 real tiles is at 272, 260, 248 and 230 (median), in as many simulated ones, made
        of 60, at 271, 258, 247 and 234 (`resemblance`). White noise as long as the way to the nearest neighbour would
        make them far too different: 303 and 269 for 10 and 220.
        """
        number = int(dice.integers(len(self)))
        rows = np.arange(self.offsets[number], self.offsets[number + 1])
        model = self.descriptors[rows]
        picked = dice.integers(self.neighbours.shape[1], size=(len(rows), _MIXED))
        weights = dice.normal(0, _SHARE, (len(rows), _MIXED, 1)).astype(np.float32)
        others = self.descriptors[self.neighbours[rows[:, None], picked]]
        mixed = (model + (weights * (others - model[:, None])).sum(1)).clip(0)
        lengths, before = (np.linalg.norm(one, axis=1, keepdims=True) for one in (mixed, model))
        return mixed * (before / np.maximum(lengths, 1e-6)), self.scores[rows]


def make_pool(tiles: Sequence[Features]) -> Pool:
    """The pool of real tiles' features. Raises: UserError for bits, too few tiles, or tiles without features."""
    tiles = [tile for tile in tiles if len(tile)]
    if len(tiles) < 2 or sum(map(len, tiles)) - max(map(len, tiles)) < _NEIGHBOURS:
        raise UserError(f"maps.pool: {len(tiles)} tiles with features are too few to simulate others; use 10 or more")
    if tiles[0].descriptors.dtype != torch.float32:
        raise UserError("simulated tiles need descriptors of numbers, not of bits; use matcher=sift")
    offsets = np.cumsum([0, *map(len, tiles)])
    joined = torch.cat([tile.descriptors for tile in tiles])
    neighbours = np.empty((len(joined), _NEIGHBOURS), np.int64)
    for start, end in pairwise(offsets):
        distances = torch.cdist(joined[start:end], joined)
        distances[:, start:end] = torch.inf
        neighbours[start:end] = distances.topk(_NEIGHBOURS, largest=False).indices.numpy()
    scores = torch.cat([tile.scores for tile in tiles]).numpy()
    return Pool(joined.numpy(), scores, offsets, neighbours)


def simulated_tiles(pool: Pool, windows: Sequence[Window], seed: int) -> Iterator[TileArrays]:
    """Features of tiles at these windows (top, left, height, width), one by one: keypoints lie evenly.

    Descriptors are whole numbers of one byte, as SIFT's are. Tile k depends on the seed and k alone.
    """
    for k, (top, left, height, width) in enumerate(windows):
        dice = np.random.default_rng((seed, k))
        descriptors, scores = pool.tile(dice)
        points = dice.uniform((left - 0.5, top - 0.5), (left + width - 0.5, top + height - 0.5), (len(scores), 2))
        # Rounding to float32 must not take a point over its tile's edge.
        inside = np.clip(points, (left, top), (left + width - 1, top + height - 1)).astype(np.float32)
        whole = descriptors.round().clip(0, 255).astype(np.uint8)
        yield {"keypoints": inside, "descriptors": whole, "scores": scores}


def resemblance(tiles: Sequence[Features], seed: int) -> dict[str, float | int]:
    """How easily simulated tiles are confused with real ones, beside how easily real ones are.

    Every second tile asks: median distance of its strongest descriptors to the nearest in the other `tiles`, all of
    other places (`real`), and in as many simulated ones, made of those (`simulated`). Equal distances mean equally
    hard. Raises: as `make_pool`.
    """
    asking, others = tiles[::2], tiles[1::2]
    pool = make_pool(others)
    made = [pool.tile(np.random.default_rng((seed, k)))[0] for k in range(len(pool))]
    probes = torch.cat([tile.descriptors[:_PROBES] for tile in asking])
    found = {"real": torch.from_numpy(pool.descriptors), "simulated": torch.from_numpy(np.concatenate(made)).round()}
    return {"tiles": len(pool), **{name: _nearest(probes, among) for name, among in found.items()}}


def _nearest(probes: Tensor, among: Tensor) -> float:
    """Median distance of the probes (N, D) to the nearest of others (M, D)."""
    return round(float(torch.cdist(probes, among).min(1).values.median()), 1)
