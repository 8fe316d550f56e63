"""The driving experiment: a record for every query, method and matcher, kept as it comes."""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace

from tqdm import tqdm

from diffnav.errors import UserError
from diffnav.evaluation.driving.drive_test import DriveTest
from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.records import RecordLog
from diffnav.evaluation.workers import spread


@dataclass(frozen=True)
class Shard:
    """Which queries this process measures: those whose number leaves `index` when divided by `count`."""

    index: int = 0
    count: int = 1

    def __post_init__(self) -> None:
        if not 0 <= self.index < self.count:
            raise UserError(f"shard must be [index, count] with 0 <= index < count, got [{self.index}, {self.count}]")

    def numbers(self, queries: int) -> list[int]:
        """The numbers of its queries."""
        return list(range(self.index, queries, self.count))


def measure_drive(
    test: DriveTest,
    log: RecordLog[DrivingRecord],
    shard: Shard,
    workers: int = 1,
    progress: bool = False,
) -> int:
    """Make the records of the shard's queries that `log` does not hold, each on disk at once; how many were made."""
    test = replace(test, known=log.keys)
    # Here, so that the workers need not: each reads weights, source files and pictures.
    _ = test.fingerprint, [m.fingerprint for m in test.methods], [m.fingerprint for m in test.matchers]
    numbers, made = shard.numbers(len(test.drive)), 0
    with (
        tqdm(total=len(numbers) * test.count, desc="queries", unit="answer", disable=not progress) as bar,
        closing(spread(test, numbers, workers)) as answers,
    ):
        for _, (_, record) in answers:
            if record is not None:
                log.add(record)
                made += 1
            bar.update()
    return made


def known_records(test: DriveTest, log: RecordLog[DrivingRecord]) -> tuple[list[DrivingRecord], int]:
    """(the records of all queries that `log` holds, query by query, how many are still to be made)."""
    keys = [key for number in range(len(test.drive)) for key in test.keys(number).values()]
    found = [log.find(key) or log.find_failure(key) for key in keys]
    records = [record for record in found if record is not None]
    return records, len(found) - len(records)


def require_one(records: Sequence[DrivingRecord]) -> None:
    """Raise UserError where no query has an answer: the first reason."""
    if records and all(record.failure for record in records):
        raise UserError(f"no query could be answered: {records[0].failure}")
