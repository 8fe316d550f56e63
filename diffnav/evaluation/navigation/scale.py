"""How a search scales with the number of tiles: seconds, memory and recall, exhaustive and by shortlist."""

import statistics
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import cv2
import numpy as np
import torch
from torch import Tensor

from diffnav.data.queries.cut import cut_queries
from diffnav.data.queries.query import Query
from diffnav.errors import UserError
from diffnav.evaluation.fingerprints import fingerprint
from diffnav.evaluation.memory import in_own_process, peak_memory_gb
from diffnav.evaluation.navigation.scale_maps import REAL_TILES, ScaleMaps, sift
from diffnav.evaluation.records import RecordLog
from diffnav.geometry.geodesy import haversine_m
from diffnav.images import write_image
from diffnav.navigation.alignment import align
from diffnav.navigation.faiss_index import faiss_index, index_file
from diffnav.navigation.gates.gate import Never
from diffnav.navigation.localizer import Localizer, Search
from diffnav.navigation.preparation import Preparation
from diffnav.navigation.reference import Reference
from diffnav.navigation.shortlist import Shortlist, joined_offsets

_CPU = torch.device("cpu")


@dataclass(frozen=True)
class ScaleRecord:
    """What one process measured on one number of tiles; figures that do not exist are None, lists are by query.

    mode: `index`, it was built (open_seconds); `shortlist` or `exhaustive`, the queries were answered. open_seconds:
    until the first query can be asked. seconds: of each query, from its picture in memory to the answer. errors_m:
    from the truth, None without a fix. ranks: of the tile that shows the query's middle, 1 for the most votes.
    milliseconds: median of each stage. idle_gb, peak_gb: resident before anything was opened, and at most. index_bytes,
    feature_bytes: on disk.
    """

    key: str
    tiles: int
    mode: str
    open_seconds: float
    idle_gb: float
    peak_gb: float
    index_bytes: int | None
    feature_bytes: int
    seconds: list[float] = field(default_factory=list)
    errors_m: list[float | None] = field(default_factory=list)
    ranks: list[int] = field(default_factory=list)
    milliseconds: dict[str, float] = field(default_factory=dict)
    failure: str | None = None


@dataclass(frozen=True)
class ScaleStudy:
    """What is measured.

    queries: pictures as large as a tile, at any heading, by day, from anywhere on the real map. features: of a query at
    most. exhaustive_to: tiles up to which every tile is tried, too. threads: of every computation.
    Raises: UserError for a setting out of range.
    """

    maps: ScaleMaps
    queries: int = 50
    features: int = 1000
    exhaustive_to: int = 1000
    threads: int = 2
    search: Search = field(default_factory=Search)

    def __post_init__(self) -> None:
        for name in ("queries", "features", "threads"):
            if getattr(self, name) < 1:
                raise UserError(f"study.{name} must be 1 or more, got {getattr(self, name)}")

    def modes(self, tiles: int) -> list[str]:
        """What is measured on so many tiles, in turn."""
        return ["index", "shortlist", *(["exhaustive"] if tiles <= self.exhaustive_to else [])]

    def key(self, tiles: int, mode: str) -> str:
        """A hash of all that decides a record."""
        facts = asdict(self) | {"tiles": tiles, "mode": mode}
        facts["maps"] |= {"cache": ""}
        return fingerprint(facts, {__name__, ScaleMaps.__module__})[:32]


def measure_scale(
    study: ScaleStudy, counts: Sequence[int], log: RecordLog[ScaleRecord], progress: bool = False
) -> list[ScaleRecord]:
    """The records of all counts of tiles, each from a process of its own; those that `log` holds are not made again.

    Raises: UserError for a count below the real tiles', too little room on the disk, or too little memory.
    """
    if not counts or min(counts) < REAL_TILES:
        raise UserError(f"counts must be numbers of {REAL_TILES} or more, got {list(counts)}: so many tiles are real")
    # Once: code that changes meanwhile must not change them.
    keys = {(count, mode): study.key(count, mode) for count in sorted(set(counts)) for mode in study.modes(count)}
    missing = {place: key for place, key in keys.items() if key not in log.keys}
    study.maps.require_room(sorted({count for count, _ in missing}))
    for (count, mode), key in missing.items():
        study.maps.database(count, progress)
        if progress:
            print(f"{count} tiles: {mode}", flush=True)
        work = (_build,) if mode == "index" else (_answer, mode, _photographed(study))
        log.add(replace(in_own_process(work[0], study, count, *work[1:]), key=key))
    return [record for record in map(log.find, keys.values()) if record is not None]


def _photographed(study: ScaleStudy) -> list[Query]:
    """The queries, their pictures drawn once and kept as files."""
    maps = study.maps
    cut = cut_queries([maps.real()], study.queries, maps.seed, size=maps.tile, heading_deg=180.0, dark=0.0)
    facts = fingerprint([asdict(maps) | {"cache": ""}, study.queries], {cut_queries.__module__})[:32]
    folder = maps.cache / "scale_queries" / facts
    for query in cut:
        if not (folder / f"{query.name}.png").is_file():
            write_image(folder / f"{query.name}.png", query.read())
    return [Query(query.name, folder / f"{query.name}.png", query.truth) for query in cut]


def _build(study: ScaleStudy, count: int) -> ScaleRecord:
    idle_gb = _begin(study)
    maps = study.maps.database(count)
    path = index_file(maps, study.maps.cache / "features", study.maps.indexed)
    path.unlink(missing_ok=True)
    start = time.perf_counter()
    faiss_index(maps, path.parent, study.maps.indexed)
    seconds = time.perf_counter() - start
    stored = sum(one.size_bytes for one in maps)
    return ScaleRecord("", count, "index", seconds, idle_gb, peak_memory_gb(_CPU), path.stat().st_size, stored)


def _answer(study: ScaleStudy, count: int, mode: str, queries: Sequence[Query]) -> ScaleRecord:
    """The record of a search of `count` tiles; the first query is asked twice, and counts the second time."""
    idle_gb = _begin(study)
    start = time.perf_counter()
    maps = study.maps.database(count)
    reference, shortlist, index_bytes = Reference(maps), None, None
    if mode == "shortlist":
        folder = study.maps.cache / "features"
        shortlist = Shortlist(joined_offsets(maps), faiss_index(maps, folder, study.maps.indexed))
        index_bytes = index_file(maps, folder, study.maps.indexed).stat().st_size
    matcher, preparation = sift(study.features), Preparation(Never(), _same)
    localizer = Localizer(reference, matcher, preparation, shortlist, search=study.search)
    opened = time.perf_counter() - start
    seconds, errors_m, ranks, stages = [], [], [], []
    for query in [queries[0], *queries]:
        prepared = preparation(query)
        assert prepared.image is not None
        assert query.truth is not None
        before = time.perf_counter()
        fix = localizer.locate_prepared(prepared)
        seconds.append(time.perf_counter() - before)
        errors_m.append(None if fix.place is None else float(haversine_m(fix.place, query.truth)))
        stages.append(fix.milliseconds)
        if shortlist is not None:
            order = shortlist.best(align(prepared.image).features(matcher), count)
            ranks.append(int(np.flatnonzero(order == _shown_by(study.maps, query))[0]) + 1)
    return ScaleRecord(
        "", count, mode, opened, idle_gb, peak_memory_gb(_CPU), index_bytes,
        sum(one.size_bytes for one in maps), seconds[1:], errors_m[1:], ranks[1:], _medians(stages[1:]),
    )  # fmt: skip


def _begin(study: ScaleStudy) -> float:
    """Set the threads of this process; its memory so far."""
    torch.set_num_threads(study.threads)
    cv2.setNumThreads(study.threads)
    return peak_memory_gb(_CPU)


def _shown_by(maps: ScaleMaps, query: Query) -> int:
    """The number of the tile that shows the query's middle; the real tiles come first, row by row."""
    x, y = maps.real().georeference.pixels(np.array(query.truth))
    return int((y + 0.5) // maps.tile[0]) * 3 + int((x + 0.5) // maps.tile[1])


def _medians(stages: Sequence[dict[str, float]]) -> dict[str, Any]:
    names = dict.fromkeys(name for one in stages for name in one if name not in ("read", "gate"))
    return {name: statistics.median(one.get(name, 0.0) for one in stages) for name in names}


def _same(image: Tensor) -> Tensor:
    return image
