"""How long Table 3 takes at full size: stage by stage, against the naive loop, and against a shortlist."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from diffnav.data.driving.driving_set import DrivingSet
from diffnav.data.driving.paired import paired_drive
from diffnav.data.driving.scenes_drive import scenes_drive
from diffnav.evaluation.driving.drive_test import DriveTest
from diffnav.evaluation.driving.measure import Shard, known_records, measure_drive
from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.driving.references import Reference, ReferenceReader, read_references
from diffnav.evaluation.memory import TreeMemory
from diffnav.evaluation.records import RecordLog
from diffnav.evaluation.workers import one_thread, spread
from diffnav.images import from_uint8, to_uint8, write_image

# The street is rendered so many times smaller and enlarged.
ENLARGED = 4


@dataclass(frozen=True)
class Stage:
    """One line of the timing. busy_s: of all processes together. wall_s: until it was done. count: of `unit`s."""

    name: str
    count: int
    unit: str
    busy_s: float | None
    wall_s: float | None


@dataclass(frozen=True)
class Speed:
    """What was measured. naive_s, pair_by_pair_s: of one pair, on one thread, features found anew or once.

    identical: whether the pairs of the subset have the same matches in all three. peak_gb: of all processes together.
    accuracy, shortlist_accuracy: of the answers among all references, and among the shortlist's.
    """

    stages: list[Stage]
    pairs: int
    subset: int
    naive_s: float
    pair_by_pair_s: float
    identical: bool
    peak_gb: float
    accuracy: float
    shortlist_accuracy: float


def street_folder(folder: Path, count: int, size: tuple[int, int], seed: int, workers: int) -> DrivingSet:
    """`count` pairs of the embedded street as JPEG files of `size` (h, w) in folder/left and right, made once.

    The street is rendered at a quarter of the size and enlarged: as many pixels to read and to search, fewer details.
    """
    small = (size[0] // ENLARGED, size[1] // ENLARGED)
    drive = scenes_drive(count, seed, small)
    sides = {"left": drive.queries, "right": drive.references}
    jobs = [(frame, folder / side / f"{frame.moment}.jpg", size) for side, own in sides.items() for frame in own]
    missing = [job for job in jobs if not job[1].exists()]
    for _ in tqdm(spread(_write, missing, workers), "pictures", len(missing), disable=not missing):
        pass
    return paired_drive(folder / "left", folder / "right")


def measure_speed(test: DriveTest, reader: ReferenceReader, shortlist: int, naive: int, workers: int) -> Speed:
    """Time everything on a drive of files. naive: queries and references of the subset for the slow ways."""
    with TreeMemory() as memory, one_thread():
        start = time.perf_counter()
        drive, references = read_references(test.drive, reader, workers, progress=True)
        stages = [Stage("references: read, features", len(references), "picture", None, time.perf_counter() - start)]
        test = replace(test, drive=drive, references=references)
        full, wall = _timed(test, workers)
        short, short_wall = _timed(replace(test, shortlist=shortlist), workers)
    pairs = len(drive) * len(references)
    stages += [
        Stage("queries: read, darken, features, match", len(drive), "query", None, wall),
        Stage("of these: features", len(drive), "picture", _total(full, "seconds_features"), None),
        Stage("of these: match", pairs, "pair", _total(full, "seconds_match"), None),
        Stage(f"queries, shortlist of {shortlist}", len(drive), "query", None, short_wall),
        Stage("of these: match", shortlist * len(drive), "pair", _total(short, "seconds_match"), None),
    ]
    chosen = np.linspace(0, len(drive) - 1, min(naive, len(drive))).round().astype(int).tolist()
    naive_s, naive_counts = _naive(test, chosen)
    pair_s, pair_counts = _pair_by_pair(test, references, chosen)
    fast_counts = [full[k].counts[j] for k in chosen for j in chosen]
    return Speed(
        stages, pairs, len(chosen) ** 2, naive_s, pair_s, naive_counts == pair_counts == fast_counts, memory.peak_gb,
        _accuracy(full), _accuracy(short),
    )  # fmt: skip


def _timed(test: DriveTest, workers: int) -> tuple[list[DrivingRecord], float]:
    """(the records of all queries, seconds that they took)."""
    log, start = RecordLog(None, DrivingRecord), time.perf_counter()
    measure_drive(test, log, Shard(), workers, progress=True)
    wall = time.perf_counter() - start
    return known_records(test, log)[0], wall


def _naive(test: DriveTest, chosen: Sequence[int]) -> tuple[float, list[int]]:
    """(seconds of a pair, matches of every pair of the subset): both pictures read and searched anew each time."""
    matcher, counts, start = test.matchers[0].matcher, [], time.perf_counter()
    with one_thread():
        for k in tqdm(chosen, "naive", unit="query"):
            for j in chosen:
                dark = test.pairs.read(test.drive.queries[k].photo(test.longest_side))["low"]
                reference = test.drive.references[j].read(test.longest_side)
                counts.append(len(matcher.match(matcher.features(dark), matcher.features(reference))))
    return (time.perf_counter() - start) / len(counts), counts


def _pair_by_pair(test: DriveTest, references: Sequence[Reference], chosen: Sequence[int]) -> tuple[float, list[int]]:
    """The same with features found once, matched by OpenCV one pair after the other."""
    named, counts, seconds = test.matchers[0], [], 0.0
    with one_thread():
        for k in chosen:
            dark = test.pairs.read(test.drive.queries[k].photo(test.longest_side))["low"]
            query = named.matcher.features(dark)
            start = time.perf_counter()
            counts += [len(named.matcher.match(query, references[j].features[named.name])) for j in chosen]
            seconds += time.perf_counter() - start
    return seconds / len(counts), counts


def _write(job: tuple) -> Iterator[None]:
    frame, path, (height, width) = job
    enlarged = cv2.resize(to_uint8(frame.read()), (width, height), interpolation=cv2.INTER_CUBIC)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_image(path, from_uint8(enlarged))
    yield None


def _total(records: Sequence[DrivingRecord], stage: str) -> float:
    return sum(getattr(record, stage) or 0.0 for record in records)


def _accuracy(records: Sequence[DrivingRecord]) -> float:
    return float(np.mean([record.answer("matches") == record.truth for record in records]))
