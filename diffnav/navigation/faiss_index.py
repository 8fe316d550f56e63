"""An index of many descriptors that answers without comparing with all of them: FAISS, of the extra `scale`."""

import hashlib
import json
import math
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from diffnav.errors import UserError
from diffnav.navigation.map_features import MapFeatures

# Of the files; another number finds none of the old ones.
_LAYOUT = 2
# Descriptors on which the cells are learned, per cell: FAISS warns below 39.
_TRAINING = 40
# From so many cells on a graph finds those nearest to a descriptor, with this many candidates at a time: of 9,000 cells
# it finds the nearest in 99 of 100 cases, in half the time.
_MANY_CELLS, _CANDIDATES = 4096, 32
# Descriptors added at once.
_BLOCK = 100_000


class FaissIndex:
    """Finds nearest descriptors among those of the cells that are nearest to a query's.

    There are twice as many cells as the square root of the descriptors, and a search costs as much as that root, too.
    probes: cells that are searched. bits: whether descriptors are. Source: Jegou et al. 2011, IVF.
    """

    def __init__(self, index: Any, bits: bool, probes: int) -> None:
        self.index, self.bits = index, bits
        index.nprobe = probes

    def search(self, descriptors: Tensor, count: int) -> tuple[np.ndarray, np.ndarray]:
        """See `NearestIndex`; computed on as many threads as torch has."""
        _faiss().omp_set_num_threads(torch.get_num_threads())
        query = descriptors.numpy() if self.bits else descriptors.float().numpy()
        distances, rows = self.index.search(np.ascontiguousarray(query), count)
        # What is missing is infinitely far: as a background it must not count.
        last = np.where(rows >= 0, distances, 0).max(1, keepdims=True)
        return np.where(rows >= 0, distances, last).astype(np.float32), rows


def faiss_index(
    maps: Sequence[MapFeatures], folder: Path, per_tile: int = 300, probes: int = 8, progress: bool = False
) -> FaissIndex:
    """The index of the strongest `per_tile` descriptors of each tile, from `folder` or built and kept there.

    Rows are those of the maps' descriptors one after the other. Descriptors of one byte are kept as they are, their
    distances are exact; others are rounded to one byte a number. Of numbers only what is searched is read into memory.
    Raises: UserError without FAISS, without descriptors, or if the folder cannot be written.
    """
    faiss, bits = _faiss(), is_binary(maps)
    path = index_file(maps, folder, per_tile)
    if not path.exists():
        _write(faiss, _built(faiss, maps, per_tile, progress), path, bits)
    try:
        if bits:
            index = faiss.read_index_binary(str(path))
        else:
            index = faiss.read_index(str(path), faiss.IO_FLAG_MMAP | faiss.IO_FLAG_READ_ONLY)
    except RuntimeError:
        raise UserError(f"{path}: does not hold the index that was stored there; delete the file") from None
    return FaissIndex(index, bits, probes)


def index_file(maps: Sequence[MapFeatures], folder: Path, per_tile: int) -> Path:
    """Where `faiss_index` keeps the index of these features."""
    facts = [[one.map.fingerprint, one.windows, one.offsets.tolist(), one.numbers] for one in maps]
    # Of descriptors too many to read, some tell by which settings they were found.
    some = [one.descriptors[:: len(one.descriptors) // 16 + 1] for one in maps]
    kinds = [[one.dtype.str, one.tolist()] for one in some]
    text = json.dumps([_LAYOUT, _TRAINING, _MANY_CELLS, per_tile, facts, kinds])
    return folder / f"{hashlib.sha256(text.encode()).hexdigest()[:32]}.faiss"


def is_binary(maps: Sequence[MapFeatures]) -> bool:
    """Whether the descriptors are bits."""
    return maps[0].descriptors.dtype.kind == "u" and not maps[0].numbers


def faiss_version() -> str:
    """Of the library. Raises: UserError without it."""
    return str(_faiss().__version__)


def _faiss() -> ModuleType:
    try:
        import faiss
    except ImportError:
        raise UserError("index=faiss needs FAISS: pip install 'diffnav[scale]', or use index=exact") from None
    return faiss


def _built(faiss: ModuleType, maps: Sequence[MapFeatures], per_tile: int, progress: bool) -> Any:
    rows = [_strongest(one, per_tile) for one in maps]
    total = sum(map(len, rows))
    if total == 0:
        raise UserError("the maps have no features to make an index of: they are of one colour")
    cells = max(1, min(round(2 * math.sqrt(total)), total // _TRAINING))
    index, bits = _empty(faiss, maps, cells), is_binary(maps)
    # Workers search on one thread each; a build is one process alone.
    faiss.omp_set_num_threads(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count())
    index.train(_sample(maps, rows, cells * _TRAINING, bits))
    first = 0
    with tqdm(total=total, desc="index", unit="descriptor", disable=not progress, leave=False) as bar:
        for one, own in zip(maps, rows, strict=True):
            for block in _blocks(own):
                index.add_with_ids(_values(one, block, bits), first + block)
                bar.update(len(block))
            first += len(one.descriptors)
    return index


def _empty(faiss: ModuleType, maps: Sequence[MapFeatures], cells: int) -> Any:
    """An untrained index."""
    graph = "_HNSW16" if cells > _MANY_CELLS else ""
    width = maps[0].descriptors.shape[1]
    if is_binary(maps):
        index = faiss.index_binary_factory(8 * width, f"BIVF{cells}{graph}")
    elif all(one.numbers for one in maps):
        index = faiss.index_factory(width, f"IVF{cells}{graph},SQ8_direct")
        # What is left of a descriptor after its cell's middle is no byte any more.
        index.by_residual = False
    else:
        # Not product-quantised: a quarter of the memory, but its codes take minutes to learn and lose neighbours.
        index = faiss.index_factory(width, f"IVF{cells}{graph},SQ8")
    if graph:
        downcast = faiss.downcast_IndexBinary if is_binary(maps) else faiss.downcast_index
        downcast(index.quantizer).hnsw.efSearch = _CANDIDATES
    return index


def _write(faiss: ModuleType, index: Any, path: Path, bits: bool) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        aside = path.with_suffix(f".{os.getpid()}.part")
        (faiss.write_index_binary if bits else faiss.write_index)(index, str(aside))
        os.replace(aside, path)
    except (OSError, RuntimeError) as error:
        raise UserError(f"{path}: cannot be written ({error}); choose another cache=") from None


def _strongest(features: MapFeatures, per_tile: int) -> np.ndarray:
    """Rows of each tile's first descriptors, which are its strongest."""
    counts = np.minimum(np.diff(features.offsets), per_tile)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.repeat(features.offsets[:-1], counts) + within


def _sample(maps: Sequence[MapFeatures], rows: Sequence[np.ndarray], most: int, bits: bool) -> np.ndarray:
    """So many descriptors, spread over all; drawn, for every tile's first or second ones would not stand for all."""
    ends = np.cumsum([0, *map(len, rows)])
    drawn = np.sort(np.random.default_rng(0).choice(ends[-1], min(most, int(ends[-1])), replace=False))
    parts = np.split(drawn, np.searchsorted(drawn, ends[1:-1]))
    own = (_values(one, some[part - end], bits) for one, some, part, end in zip(maps, rows, parts, ends, strict=False))
    return np.concatenate(list(own))


def _blocks(rows: np.ndarray) -> Iterator[np.ndarray]:
    for start in range(0, len(rows), _BLOCK):
        yield rows[start : start + _BLOCK]


def _values(features: MapFeatures, rows: np.ndarray, bits: bool) -> np.ndarray:
    return np.ascontiguousarray(features.descriptors[rows], np.uint8 if bits else np.float32)
