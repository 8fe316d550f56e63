"""All records of a drive: made once, kept as they come, the same from one process or many, whole or in shards."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from driving_stubs import Brighten, answer, drive_test, gms, methods, noise_drive, told

from diffnav.enhancers.input import Input
from diffnav.errors import UserError
from diffnav.evaluation.contest import NamedMatcher
from diffnav.evaluation.driving.drive_test import DriveTest
from diffnav.evaluation.driving.measure import Shard, known_records, measure_drive, require_one
from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.records import RecordLog
from diffnav.matching.sift import Sift

Log = RecordLog[DrivingRecord]


def log_in(folder: Path, name: str = "records.jsonl", beside: tuple[str, ...] = ()) -> Log:
    return RecordLog(folder / name, DrivingRecord, [folder / other for other in beside])


@pytest.fixture(scope="module")
def task() -> DriveTest:
    """Five queries, two methods and two matchers."""
    matchers = [gms(threshold_factor=2.0), NamedMatcher("sift", Sift(features=60))]
    return drive_test(noise_drive(5), methods(input=Input(), net=Brighten()), matchers)


@pytest.fixture(scope="module")
def whole(task: DriveTest) -> list[DrivingRecord]:
    log: Log = RecordLog(None, DrivingRecord)
    assert measure_drive(task, log, Shard()) == 20
    records, missing = known_records(task, log)
    assert missing == 0
    return records


def test_a_record_for_every_query_method_and_matcher(task: DriveTest, whole: list[DrivingRecord]) -> None:
    assert [(one.name, one.method, one.matcher) for one in whole] == [
        (f"left/{k}", method, matcher)
        for k in range(5)
        for method in ("input", "net")
        for matcher in ("orb_gms", "sift")
    ]
    assert [one.key for one in whole] == [key for k in range(5) for key in task.keys(k).values()]
    assert all(one.counts[one.truth] > 0 for one in whole)


def test_a_second_run_makes_nothing_again(task: DriveTest, whole: list[DrivingRecord], tmp_path: Path) -> None:
    few = replace(task, methods=task.methods[1:])
    Brighten.calls = 0
    assert measure_drive(few, log_in(tmp_path), Shard()) == 10
    # Each query once, and the first once before, for the timing.
    assert Brighten.calls == 6
    content = (tmp_path / "records.jsonl").read_bytes()
    log = log_in(tmp_path)
    assert measure_drive(few, log, Shard()) == 0
    assert Brighten.calls == 6
    assert (tmp_path / "records.jsonl").read_bytes() == content
    records, missing = known_records(few, log)
    assert missing == 0
    assert [told(one) for one in records] == [told(one) for one in whole if one.method == "net"]
    # One method more: what is there stays.
    assert measure_drive(task, log_in(tmp_path), Shard()) == 10
    assert Brighten.calls == 6


def test_a_killed_run_goes_on_where_it_stood(task: DriveTest, whole: list[DrivingRecord], tmp_path: Path) -> None:
    class Killed(Log):
        def add(self, record: DrivingRecord) -> None:
            super().add(record)
            if (record.name, record.method) == ("left/2", "net"):
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        measure_drive(task, Killed(tmp_path / "records.jsonl", DrivingRecord), Shard())
    with (tmp_path / "records.jsonl").open("a") as file:
        file.write('{"key": "half a li')
    log = log_in(tmp_path)
    known, missing = known_records(task, log)
    assert (len(known), missing) == (11, 9)
    assert measure_drive(task, log, Shard()) == 9
    records, missing = known_records(task, log_in(tmp_path))
    assert missing == 0
    assert [told(one) for one in records] == [told(one) for one in whole]
    assert len((tmp_path / "records.jsonl").read_text().splitlines()) == 20


def test_two_processes_make_what_one_makes(task: DriveTest, whole: list[DrivingRecord], tmp_path: Path) -> None:
    assert measure_drive(task, log_in(tmp_path), Shard(), workers=2) == 20
    records, _ = known_records(task, log_in(tmp_path))
    assert [one.key for one in records] == [one.key for one in whole]
    assert [told(one) for one in records] == [told(one) for one in whole]


def test_shards_together_are_the_whole(task: DriveTest, whole: list[DrivingRecord], tmp_path: Path) -> None:
    names = [f"records-{k}.jsonl" for k in range(3)]
    made = []
    for k, name in enumerate(names):
        # The first sees nothing of the others, as when all start together.
        log = log_in(tmp_path, name, tuple(names[:k]) if k else ())
        made.append(measure_drive(task, log, Shard(k, 3)))
        records, missing = known_records(task, log)
        assert len(records) + missing == 20
    assert made == [8, 8, 4]
    assert missing == 0
    assert [told(one) for one in records] == [told(one) for one in whole]
    queries = [{json.loads(line)["name"] for line in (tmp_path / name).read_text().splitlines()} for name in names]
    assert queries == [{"left/0", "left/3"}, {"left/1", "left/4"}, {"left/2"}]
    # A run that is not divided takes them over.
    assert measure_drive(task, log_in(tmp_path, beside=tuple(names)), Shard()) == 0


def test_failures_are_kept_and_tried_again(tmp_path: Path) -> None:
    drive = noise_drive(2)
    weak, well = (drive_test(drive, methods(net=Brighten(fails=fails))) for fails in (True, False))
    # Weights and settings are the same: its failure has the key of what it should have made.
    assert weak.keys(0) == well.keys(0)
    assert measure_drive(weak, log_in(tmp_path), Shard()) == 2
    # Another shard finds them in the file.
    records, missing = known_records(weak, log_in(tmp_path, "other.jsonl", ("records.jsonl",)))
    assert ([one.failure for one in records], missing) == (["net: out of memory"] * 2, 0)
    assert measure_drive(well, log_in(tmp_path), Shard()) == 2
    records, missing = known_records(well, log_in(tmp_path))
    assert ([one.failure for one in records], missing) == ([None, None], 0)
    assert measure_drive(well, log_in(tmp_path), Shard()) == 0


def test_without_any_answer_the_first_reason_is_told() -> None:
    failed = answer(0, method="net", failure="net: out of memory")
    require_one([failed, answer(1, 1)])
    require_one([])
    with pytest.raises(UserError, match=r"^no query could be answered: net: out of memory$"):
        require_one([failed, answer(1, failure="another")])


def test_which_queries_a_shard_asks() -> None:
    assert Shard().numbers(3) == [0, 1, 2]
    assert [Shard(k, 3).numbers(7) for k in range(3)] == [[0, 3, 6], [1, 4], [2, 5]]
    assert Shard(2, 3).numbers(2) == []
    for index, count in ((1, 1), (-1, 2), (0, 0), (3, 2)):
        with pytest.raises(UserError, match=rf"0 <= index < count, got \[{index}, {count}\]"):
            Shard(index, count)
