"""Which tiles a query might show: votes of its descriptors' nearest neighbours among those of all tiles."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from diffnav.matching.matches import Features
from diffnav.navigation.map_features import MapFeatures

# Descriptors compared with the query's at once: their distances should stay in the processor's cache.
_BLOCK = 4_096


class NearestIndex(Protocol):
    """Finds the nearest of many stored descriptors."""

    def search(self, descriptors: Tensor, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Squared distances and rows (n, count) of the stored descriptors nearest to each (n, D), nearest first.

        A row of -1 stands for none.
        """
        ...


class Shortlist:
    """Ranks tiles by local naive Bayes nearest neighbours.

    Each descriptor of the query finds its `neighbours` + 1 nearest of all tiles; the last tells how far a chance
    neighbour is; each tile among the others gains by how much its best one is nearer than that.
    Source: McCann & Lowe 2012, algorithm 2.
    """

    def __init__(self, offsets: np.ndarray, index: NearestIndex, neighbours: int = 10) -> None:
        self.offsets, self.index, self.neighbours = offsets, index, neighbours

    def votes(self, query: Features) -> np.ndarray:
        """(T,) what each tile gains, >= 0."""
        gains = np.zeros(len(self.offsets) - 1)
        if len(query) == 0:
            return gains
        distances, rows = self.index.search(query.descriptors, self.neighbours + 1)
        # Where all tiles together have fewer, the farthest that there is.
        background = np.where(rows >= 0, distances, 0.0).max(1, keepdims=True)
        gain = background - np.where(rows[:, :-1] >= 0, distances[:, :-1], background)
        tiles = np.searchsorted(self.offsets, rows[:, :-1], side="right") - 1
        # A tile counts once for a descriptor, by its nearest: neighbours come nearest first.
        line = np.arange(len(tiles))[:, None] * len(gains) + tiles
        _, first = np.unique(line, return_index=True)
        np.add.at(gains, tiles.ravel()[first], gain.ravel()[first])
        return gains

    def best(self, query: Features, count: int, allowed: np.ndarray | None = None) -> np.ndarray:
        """The numbers of the `count` tiles with the most votes, best first; only of `allowed`, where given."""
        votes = self.votes(query)
        numbers = np.arange(len(votes)) if allowed is None else allowed
        return numbers[np.argsort(-votes[numbers], kind="stable")[:count]]


def joined_offsets(maps: Sequence[MapFeatures]) -> np.ndarray:
    """(T + 1,) where each tile's descriptors begin when the maps' stand one after the other."""
    lengths = np.concatenate([np.diff(features.offsets) for features in maps])
    return np.concatenate([[0], np.cumsum(lengths)])


class ExactIndex:
    """Compares with every stored descriptor: exact, in time and without memory of its own.

    Descriptors are numbers (float32, or uint8 with `numbers`), or bits (uint8), whose distance is that of Hamming.
    """

    def __init__(self, parts: Sequence[np.ndarray], bits: bool) -> None:
        self.parts, self.bits = parts, bits

    def search(self, descriptors: Tensor, count: int) -> tuple[np.ndarray, np.ndarray]:
        """See `NearestIndex`."""
        query = _numbers(descriptors, self.bits)
        best = torch.full((len(query), count), torch.inf)
        rows = torch.full((len(query), count), -1, dtype=torch.long)
        start = 0
        for part in self.parts:
            for first in range(0, len(part), _BLOCK):
                block = _numbers(torch.from_numpy(np.array(part[first : first + _BLOCK])), self.bits)
                # Less the query's own square, which orders nothing.
                distances = torch.addmm(block.square().sum(1), query, block.T, alpha=-2)
                near, where = distances.topk(min(count, len(block)), largest=False)
                best, order = torch.cat([best, near], 1).topk(count, largest=False)
                rows = torch.cat([rows, where + start + first], 1).gather(1, order)
            start += len(part)
        return (best + query.square().sum(1, keepdim=True)).clamp(min=0).numpy(), rows.numpy()


def _numbers(descriptors: Tensor, bits: bool) -> Tensor:
    """(n, D) float32; of bits, (n, 8 D) zeros and ones, whose squared distance is the number of bits that differ."""
    if not bits:
        return descriptors.float()
    return torch.from_numpy(np.unpackbits(descriptors.numpy(), axis=1)).float()
