"""Records on disk: found again, beside those of other processes, failures tried again, half lines left out."""

import json
import os
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from diffnav.errors import UserError
from diffnav.evaluation.records import RecordLog


@dataclass(frozen=True)
class Kept:
    key: str
    value: float
    failure: str | None = None
    counts: list[int] = field(default_factory=list)


def log_in(folder: Path, name: str = "records.jsonl", beside: tuple[str, ...] = ()) -> RecordLog[Kept]:
    return RecordLog(folder / name, Kept, [folder / other for other in beside])


def write(path: Path, *records: Kept, half: str = "") -> None:
    path.write_text("".join(json.dumps(vars(record)) + "\n" for record in records) + half)


def test_a_record_is_found_again_as_it_was(tmp_path: Path) -> None:
    record = Kept("a", 1 / 3, counts=[3, -1])
    log = log_in(tmp_path / "new" / "folder")
    log.add(record)
    assert (log.find("a"), log.find("b"), log.reused) == (record, None, 1)
    again = log_in(tmp_path / "new" / "folder")
    assert again.find("a") == record
    assert again.keys == {"a"}


def test_without_a_file_records_are_kept_in_memory() -> None:
    log: RecordLog[Kept] = RecordLog(None, Kept)
    log.add(Kept("a", 1))
    assert log.find("a") == Kept("a", 1)


def test_other_processes_records_are_read_and_never_written(tmp_path: Path) -> None:
    write(tmp_path / "0.jsonl", Kept("a", 1), Kept("b", 2))
    write(tmp_path / "1.jsonl", Kept("c", 3))
    before = {name: (tmp_path / name).read_bytes() for name in ("0.jsonl", "1.jsonl")}
    log = log_in(tmp_path, "own.jsonl", ("0.jsonl", "1.jsonl"))
    assert log.keys == {"a", "b", "c"}
    assert not (tmp_path / "own.jsonl").exists()
    log.add(Kept("d", 4))
    assert [json.loads(line)["key"] for line in (tmp_path / "own.jsonl").read_text().splitlines()] == ["d"]
    assert {name: (tmp_path / name).read_bytes() for name in before} == before
    # Of one key the own record counts.
    log.add(Kept("a", 9))
    assert log_in(tmp_path, "own.jsonl", ("0.jsonl",)).find("a") == Kept("a", 9)


def test_half_a_line_is_left_out_and_cut_off_in_the_own_file_alone(tmp_path: Path) -> None:
    """Another process may be writing its line at this very moment."""
    for name in ("own.jsonl", "other.jsonl"):
        write(tmp_path / name, Kept(name, 1), half='{"key": "half", "val')
    other = (tmp_path / "other.jsonl").read_bytes()
    log = log_in(tmp_path, "own.jsonl", ("other.jsonl",))
    assert log.keys == {"own.jsonl", "other.jsonl"}
    assert (tmp_path / "other.jsonl").read_bytes() == other
    log.add(Kept("next", 2))
    assert log_in(tmp_path, "own.jsonl").keys == {"own.jsonl", "next"}
    # Half a line that would be whole but for its end.
    write(tmp_path / "other.jsonl", half=json.dumps(vars(Kept("whole", 1))))
    assert log_in(tmp_path, "third.jsonl", ("other.jsonl",)).keys == frozenset()


def test_failures_are_tried_again_and_yet_known(tmp_path: Path) -> None:
    failed, other = Kept("a", 0, "no memory"), Kept("b", 0, "damaged")
    log = log_in(tmp_path)
    log.add(failed)
    # The process that met it goes on with it.
    assert log.find("a") == failed
    assert log.find_failure("a") is None
    write(tmp_path / "other.jsonl", other)
    again = log_in(tmp_path, beside=("other.jsonl",))
    assert again.keys == frozenset()
    assert (again.find("a"), again.find("b"), again.reused) == (None, None, 0)
    assert (again.find_failure("a"), again.find_failure("b"), again.find_failure("c")) == (failed, other, None)
    again.add(Kept("a", 5))
    assert again.find("a") == Kept("a", 5)
    # In the file the failure still comes first.
    third = log_in(tmp_path)
    assert (third.find("a"), third.keys) == (Kept("a", 5), {"a"})


@pytest.mark.parametrize(
    "line", ["something else", "[1, 2]", "3", '{"key": "a"}', '{"key": "a", "value": 1, "more": 2}']
)
def test_a_file_of_other_things_is_refused(line: str, tmp_path: Path) -> None:
    (tmp_path / "other.jsonl").write_text(f"{line}\n")
    for log in ({"name": "other.jsonl"}, {"beside": ("other.jsonl",)}):
        with pytest.raises(UserError, match=r"other\.jsonl: not the records of an evaluation; remove it or choose"):
            log_in(tmp_path, **log)
    assert (tmp_path / "other.jsonl").read_text() == f"{line}\n"


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"cannot be written .*; choose another out="):
        log_in(tmp_path / "file" / "out")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_is_closed(tmp_path: Path) -> None:
    (tmp_path / "closed").mkdir(mode=0o500)
    with pytest.raises(UserError, match="choose another out="):
        log_in(tmp_path / "closed" / "out")
