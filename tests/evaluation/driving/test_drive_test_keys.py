"""Which records of a drive are made again, and which pictures: what decides them is in their keys."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from driving_stubs import Brighten, answers, drive_test, gms, methods, noise_drive

from diffnav.data.driving.driving_set import DrivingSet
from diffnav.enhancers.input import Input
from diffnav.evaluation.driving.drive_test import DriveTest
from diffnav.evaluation.predictions import PredictionCache


def test_what_is_known_is_not_made_again(task: DriveTest) -> None:
    keys = task.keys(2)
    assert list(keys) == [(m, n) for m in ("input", "gamma_blind", "normal") for n in ("orb_gms", "sift")]
    known = frozenset(key for label, key in keys.items() if label != ("gamma_blind", "sift"))
    made = list(replace(task, known=known)(2))
    assert [key for key, _ in made] == list(keys.values())
    (record,) = [record for _, record in made if record is not None]
    assert (record.method, record.matcher, record.key) == ("gamma_blind", "sift", keys["gamma_blind", "sift"])


def test_nothing_is_read_where_everything_is_known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    task = drive_test(noise_drive(2, tmp_path), methods(input=Input()))
    known = replace(task, known=frozenset(task.keys(0).values()))

    def refuse(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr("diffnav.images.decode", refuse)
    assert [record for _, record in known(0)] == [None]


def test_keys_change_with_whatever_decides_a_record(task: DriveTest, drive: DrivingSet) -> None:
    def key(other: DriveTest, number: int = 0) -> str:
        return other.keys(number)["input", "orb_gms"]

    others: Sequence[DriveTest] = [
        replace(task, darkness={"gamma": [1, 1]}),
        replace(task, pairs=replace(task.pairs, seed=8)),
        replace(task, shortlist=2),
        replace(task, verified=3),
        replace(task, verification={"model": "fundamental", "seed": 1}),
        replace(task, longest_side=100),
        replace(task, matchers=[gms(threshold_factor=3.0)]),
        drive_test(drive.without({3: "gone"}), task.methods, task.matchers),
    ]
    keys = [key(task), key(task, 1), *map(key, others)]
    assert len(set(keys)) == len(keys)
    # What is measured beside it decides nothing.
    assert key(replace(task, methods=task.methods[:1], matchers=task.matchers[:1])) == key(task)
    assert key(drive_test(noise_drive(4), task.methods, task.matchers)) == key(task)


def test_enhanced_pictures_are_kept_for_other_matchers(drive: DrivingSet, tmp_path: Path) -> None:
    Brighten.calls = 0
    rows, cache = methods(net=Brighten()), PredictionCache(tmp_path)
    (first,) = answers(drive_test(drive, rows, cache=cache), 0)
    # Once, and once before for the timing.
    assert Brighten.calls == 2
    (again,) = answers(drive_test(drive, rows, [gms(threshold_factor=9.0)], cache=cache), 0)
    assert Brighten.calls == 2
    assert again.seconds_enhance == first.seconds_enhance
    assert sum(again.counts) < sum(first.counts)
