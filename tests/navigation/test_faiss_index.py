"""The index of FAISS against comparing with every descriptor, and what it keeps on disk."""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import torch
from made_maps import picture_map

from diffnav.errors import UserError
from diffnav.matching.matches import Features
from diffnav.navigation import faiss_index as faiss_module
from diffnav.navigation.faiss_index import FaissIndex, faiss_index, index_file, is_binary
from diffnav.navigation.map_features import MapFeatures
from diffnav.navigation.shortlist import Shortlist, joined_offsets

pytest.importorskip("faiss", reason="FAISS, of the extra `scale`, is not installed")

ALL_CELLS = 10_000


def features_of(descriptors: np.ndarray, lengths: Sequence[int], name: str, numbers: bool) -> MapFeatures:
    """Tiles with so many of the descriptors each, at the places 0, 1, 2, ..."""
    count = len(descriptors)
    points = np.stack([np.arange(count), np.zeros(count)], 1).astype(np.float32)
    windows = tuple((0, 100 * k, 50, 100) for k in range(len(lengths)))
    geo_map = picture_map(torch.zeros(3, 50, 100 * len(lengths)), name)
    return MapFeatures(
        geo_map, windows, np.cumsum([0, *lengths]), points, descriptors, np.ones(count, np.float32), numbers
    )


def drawn(kind: str, count: int, seed: int) -> np.ndarray:
    """Descriptors around 12 middles, as real ones crowd."""
    dice = np.random.default_rng(seed)
    middles = np.random.default_rng(99).uniform(60, 190, (12, 16))
    values = middles[dice.integers(0, 12, count)] + dice.normal(0, 20, (count, 16))
    if kind == "float":
        return (values / 255).astype(np.float32)
    return values.round().clip(0, 255).astype(np.uint8)


def two_maps(kind: str) -> list[MapFeatures]:
    """Seven tiles of two maps, two of them empty."""
    lengths = [(40, 0, 90), (120, 33, 0, 70)]
    return [
        features_of(drawn(kind, sum(own), seed), own, f"map_{seed}", kind == "numbers")
        for seed, own in enumerate(lengths)
    ]


def slow_search(
    maps: Sequence[MapFeatures], query: np.ndarray, per_tile: int, bits: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Squared distances (n, N) to all descriptors of the maps and the rows of those that count."""
    stored = np.concatenate([one.descriptors for one in maps])
    rows, start = [], 0
    for one in maps:
        for length in np.diff(one.offsets):
            rows += range(start, start + min(int(length), per_tile))
            start += int(length)
    if bits:
        stored, query = np.unpackbits(stored, axis=1), np.unpackbits(query, axis=1)
    return ((query[:, None].astype(float) - stored.astype(float)) ** 2).sum(-1), np.array(rows)


@pytest.mark.parametrize("graph", [False, True])
@pytest.mark.parametrize("kind", ["numbers", "float", "bits"])
def test_with_all_cells_it_finds_the_nearest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, graph: bool
) -> None:
    if graph:
        monkeypatch.setattr(faiss_module, "_MANY_CELLS", 2)
    maps = two_maps(kind)
    query = drawn(kind, 25, 7)
    index = faiss_index(maps, tmp_path, per_tile=50, probes=ALL_CELLS)
    # As features come: numbers as float32, whatever the map keeps.
    given = torch.from_numpy(query) if kind != "numbers" else torch.from_numpy(query).float()
    distances, rows = index.search(given, 6)
    expected, counted = slow_search(maps, query, 50, kind == "bits")
    assert set(rows.ravel().tolist()) <= set(counted.tolist())
    nearest = np.sort(expected[:, counted], axis=1)[:, :6]
    found = np.take_along_axis(expected, rows, 1)
    # A byte of 0 to 1 rounds by .002 a number at most; of 16 numbers that is .01, of distances about 1.
    slack = 0.05 if kind == "float" else 0.0
    assert np.abs(found - nearest).max() <= slack
    assert np.abs(distances - nearest).max() <= max(slack, 1e-3)
    assert distances.dtype == np.float32


def test_few_cells_find_nearly_as_much(tmp_path: Path) -> None:
    maps = [features_of(drawn("numbers", 4000, 1), [400] * 10, "large", True)]
    query = drawn("numbers", 50, 2)
    expected, _ = slow_search(maps, query, 400, False)
    nearest = expected.argmin(1)
    share = {}
    for probes in (1, 8, ALL_CELLS):
        _, rows = faiss_index(maps, tmp_path, 400, probes).search(torch.from_numpy(query), 1)
        share[probes] = (rows[:, 0] == nearest).mean()
    assert share[1] < share[8] <= share[ALL_CELLS] == 1
    assert share[8] > 0.8


@pytest.mark.parametrize("kind", ["numbers", "bits"])
def test_what_is_missing_counts_as_far_as_the_farthest(tmp_path: Path, kind: str) -> None:
    maps = [features_of(drawn(kind, 3, 0), [3], "small", kind == "numbers")]
    distances, rows = faiss_index(maps, tmp_path).search(torch.from_numpy(drawn(kind, 2, 1)), 5)
    assert np.sort(rows, axis=1).tolist() == [[-1, -1, 0, 1, 2]] * 2
    assert (distances[:, 3:] == distances[:, 2:3]).all()
    assert (distances[:, 2] >= distances[:, 0]).all()


def test_it_votes_for_the_tile_that_shows_the_query(tmp_path: Path) -> None:
    """Of descriptors that crowd, the query's are those of one tile, with noise."""
    maps = two_maps("numbers")
    noisy = maps[1].descriptors[120:153] + np.random.default_rng(3).normal(0, 2, (33, 16))
    query = Features(torch.zeros(33, 2), torch.from_numpy(noisy).float(), torch.ones(33), (50, 100))
    shortlist = Shortlist(joined_offsets(maps), faiss_index(maps, tmp_path, 50))
    assert shortlist.best(query, 3)[0] == 4


def test_it_is_built_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    maps = two_maps("numbers")
    query = torch.from_numpy(drawn("numbers", 5, 7))
    before = faiss_index(maps, tmp_path, 50).search(query, 4)
    (file,) = tmp_path.iterdir()
    assert file == index_file(maps, tmp_path, 50)
    # Settings or features that would give another index have another file.
    assert index_file(maps, tmp_path, 60) != file
    assert index_file(maps[:1], tmp_path, 50) != file
    assert index_file(two_maps("bits"), tmp_path, 50) != file
    others = two_maps("numbers")
    others[0].descriptors[0] += 1
    assert index_file(others, tmp_path, 50) != file
    assert index_file(two_maps("numbers"), tmp_path, 50) == file
    monkeypatch.setattr(faiss_module, "_built", lambda *_: pytest.fail("built again"))
    after = faiss_index(maps, tmp_path, 50).search(query, 4)
    assert all((one == other).all() for one, other in zip(before, after, strict=True))


def test_it_computes_on_as_many_threads_as_torch(tmp_path: Path) -> None:
    """A worker of an evaluation has one; FAISS itself would take all cores for each."""
    import faiss

    maps, before = two_maps("numbers"), torch.get_num_threads()
    index = faiss_index(maps, tmp_path, 50)
    try:
        for threads in (1, 2):
            torch.set_num_threads(threads)
            index.search(torch.from_numpy(drawn("numbers", 5, 7)), 4)
            assert faiss.omp_get_max_threads() == threads
    finally:
        torch.set_num_threads(before)


def test_bits_and_numbers_are_told_apart() -> None:
    assert [is_binary(two_maps(kind)) for kind in ("numbers", "float", "bits")] == [False, False, True]


def test_no_features_are_refused(tmp_path: Path) -> None:
    empty = features_of(drawn("numbers", 0, 0), [0, 0], "flat", True)
    with pytest.raises(UserError, match="the maps have no features to make an index of: they are of one colour"):
        faiss_index([empty], tmp_path)


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(UserError, match=r"file.*\.faiss: cannot be written \(.*\); choose another cache="):
        faiss_index(two_maps("numbers"), tmp_path / "file")


@pytest.mark.parametrize("kind", ["numbers", "bits"])
@pytest.mark.parametrize("kept", [0, 50, 0.9])
def test_a_damaged_file_is_named(tmp_path: Path, kind: str, kept: float) -> None:
    maps = two_maps(kind)
    faiss_index(maps, tmp_path)
    (file,) = tmp_path.iterdir()
    whole = file.read_bytes()
    file.unlink()
    file.write_bytes(whole[: int(kept if kept >= 1 else kept * len(whole))])
    with pytest.raises(UserError, match=f"{file.name}: does not hold the index .*; delete the file"):
        faiss_index(maps, tmp_path)


def test_without_faiss_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "faiss", None)
    with pytest.raises(UserError, match=r"pip install 'diffnav\[scale\]', or use index=exact"):
        faiss_index(two_maps("numbers"), tmp_path)


def test_the_index_type_is_what_the_shortlist_takes(tmp_path: Path) -> None:
    assert isinstance(faiss_index(two_maps("float"), tmp_path), FaissIndex)
