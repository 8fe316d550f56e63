"""What the scale study measures, on tiles so small that it takes seconds."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import torch
from PIL import Image

from diffnav.data.queries.cut import cut_queries
from diffnav.errors import UserError
from diffnav.evaluation.navigation import scale
from diffnav.evaluation.navigation.scale import ScaleRecord, ScaleStudy, measure_scale
from diffnav.evaluation.navigation.scale_maps import ScaleMaps
from diffnav.evaluation.records import RecordLog
from diffnav.geometry.homography import apply_homography
from diffnav.navigation.localizer import Search

pytest.importorskip("faiss", reason="FAISS, of the extra `scale`, is not installed")

processes: list[tuple[str, int]] = []


def here(function: Callable[..., ScaleRecord], *arguments: Any) -> ScaleRecord:
    """In this process, for speed."""
    processes.append((function.__name__, arguments[1]))
    return function(*arguments)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ScaleStudy]:
    """Nine tiles of 128 x 160 pixels, three queries."""
    before = torch.get_num_threads(), cv2.getNumThreads()
    maps = ScaleMaps(tmp_path_factory.mktemp("cache"), (128, 160), 90, 60, 4)
    yield ScaleStudy(maps, 3, 250, exhaustive_to=9, threads=1, search=Search(tiles=4))
    torch.set_num_threads(before[0])
    cv2.setNumThreads(before[1])


@pytest.fixture(scope="module")
def records(study: ScaleStudy, tmp_path_factory: pytest.TempPathFactory) -> list[ScaleRecord]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scale, "in_own_process", here)
        log = RecordLog(tmp_path_factory.mktemp("out") / "records.jsonl", ScaleRecord)
        return measure_scale(study, [30, 9, 9], log)


def test_each_measurement_has_a_process_of_its_own(records: list[ScaleRecord]) -> None:
    expected = [(9, "index"), (9, "shortlist"), (9, "exhaustive"), (30, "index"), (30, "shortlist")]
    assert [(record.tiles, record.mode) for record in records] == expected
    assert processes == [("_build", 9), ("_answer", 9), ("_answer", 9), ("_build", 30), ("_answer", 30)]
    assert len({record.key for record in records}) == 5


def test_queries_are_timed_and_their_places_found(records: list[ScaleRecord]) -> None:
    for record in records:
        assert 0 < record.idle_gb <= record.peak_gb < 8
        assert record.open_seconds > 0
        if record.mode == "index":
            assert record.seconds == record.ranks == record.errors_m == []
            continue
        assert len(record.seconds) == len(record.errors_m) == 3
        assert min(record.seconds) > 0
        # A pixel is .3 m; more than half of the queries are found.
        assert sum(error is not None and error < 1 for error in record.errors_m) >= 2
        stages = ["features", "shortlist", "match", "refine"]
        assert list(record.milliseconds) == [name for name in stages if name != "shortlist" or record.ranks]
        assert sum(record.milliseconds.values()) <= 1000 * sum(record.seconds)


def test_ranks_are_those_of_the_tile_that_shows_the_middle(study: ScaleStudy, records: list[ScaleRecord]) -> None:
    maps = study.maps
    for query in cut_queries([maps.real()], 30, maps.seed, size=maps.tile, heading_deg=180.0):
        x, y = apply_homography(query.H_query_map, torch.tensor([[79.5, 63.5]], dtype=torch.float64))[0].tolist()
        # Pixels of the map from its outer corner.
        row, column = [y + 0.5 < 128, y + 0.5 < 256, True].index(True), [x + 0.5 < 160, x + 0.5 < 320, True].index(True)
        assert scale._shown_by(maps, query) == 3 * row + column
    for record in records:
        if record.mode == "shortlist":
            assert len(record.ranks) == 3
            assert min(record.ranks) >= 1
            assert max(record.ranks) <= 4 < record.tiles, "a query meets four tiles at most"


def test_sizes_are_those_on_disk(study: ScaleStudy, records: list[ScaleRecord]) -> None:
    sizes = {path.stat().st_size for path in (study.maps.cache / "features").glob("*.faiss")}
    told = {record.index_bytes for record in records if record.mode != "exhaustive"}
    assert len(told) == 2
    assert told <= sizes
    assert next(record.index_bytes for record in records if record.mode == "exhaustive") is None
    features = sum(int(one.offsets[-1]) for one in study.maps.database(30))
    assert records[-1].feature_bytes == features * 140 + 8 * (9 + 1 + 21 + 1)


def test_what_was_measured_is_not_measured_again(
    study: ScaleStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, records: list[ScaleRecord]
) -> None:
    log = RecordLog(tmp_path / "records.jsonl", ScaleRecord)
    for record in records:
        log.add(record)
    made: list[tuple[str, int]] = []

    def note(function: Callable[..., ScaleRecord], *arguments: Any) -> ScaleRecord:
        made.append((function.__name__, arguments[1]))
        return here(function, *arguments)

    monkeypatch.setattr(scale, "in_own_process", note)
    again = RecordLog(tmp_path / "records.jsonl", ScaleRecord)
    assert measure_scale(study, [9, 30], again) == records
    assert made == []
    # Of another number of tiles only what is missing.
    assert [record.tiles for record in measure_scale(study, [9, 12], again)] == [9, 9, 9, 12, 12]
    assert made == [("_build", 12), ("_answer", 12)]


def test_an_index_of_before_is_built_anew_to_be_timed(
    study: ScaleStudy, monkeypatch: pytest.MonkeyPatch, records: list[ScaleRecord]
) -> None:
    monkeypatch.setattr(scale, "in_own_process", here)
    files = {path: path.stat().st_mtime_ns for path in (study.maps.cache / "features").glob("*.faiss")}
    log: RecordLog[ScaleRecord] = RecordLog(None, ScaleRecord)
    for record in records[1:]:
        log.add(record)
    measure_scale(study, [9], log)
    assert sum(path.stat().st_mtime_ns != before for path, before in files.items()) == 1


def test_keys_hold_what_decides_but_not_where_it_is_kept(study: ScaleStudy, tmp_path: Path) -> None:
    key = study.key(9, "shortlist")
    assert replace(study, maps=replace(study.maps, cache=tmp_path)).key(9, "shortlist") == key
    others = [
        study.key(10, "shortlist"),
        study.key(9, "exhaustive"),
        replace(study, queries=4).key(9, "shortlist"),
        replace(study, threads=2).key(9, "shortlist"),
        replace(study, search=Search(tiles=5)).key(9, "shortlist"),
        replace(study, maps=replace(study.maps, indexed=50)).key(9, "shortlist"),
    ]
    assert len({key, *others}) == 7


@pytest.mark.parametrize("counts", [[], [100, 8]])
def test_fewer_tiles_than_are_real_are_refused(study: ScaleStudy, counts: list[int]) -> None:
    with pytest.raises(UserError, match="counts must be numbers of 9 or more, got"):
        measure_scale(study, counts, RecordLog(None, ScaleRecord))


@pytest.mark.parametrize("name", ["queries", "features", "threads"])
def test_settings_out_of_range(tmp_path: Path, name: str) -> None:
    with pytest.raises(UserError, match=f"study.{name} must be 1 or more, got 0"):
        ScaleStudy(ScaleMaps(tmp_path), **{name: 0})


def test_pictures_are_drawn_once(study: ScaleStudy, records: list[ScaleRecord]) -> None:
    assert records
    queries = scale._photographed(study)
    cut = cut_queries([study.maps.real()], 3, study.maps.seed, size=study.maps.tile, heading_deg=180.0, dark=0.0)
    for query, original in zip(queries, cut, strict=True):
        assert query.truth == original.truth
        assert isinstance(query.image, Path)
        with Image.open(query.image) as picture:
            assert picture.size == (160, 128)
        assert np.abs(query.read().numpy() - original.read().numpy()).max() < 1e-6
