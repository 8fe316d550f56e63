"""Figure 11: which queries it shows, and that it is drawn."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from driving_stubs import Brighten, answer, drive_test, hand_drive, methods, noise_drive
from PIL import Image

from diffnav.enhancers.gamma_blind import GammaBlind
from diffnav.enhancers.input import Input
from diffnav.enhancers.normal import Normal
from diffnav.evaluation.driving.drive_test import DriveTest
from diffnav.evaluation.driving.figure_11 import choose_queries, outcome, write_figure_11
from diffnav.evaluation.driving.measure import Shard, known_records, measure_drive
from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.records import RecordLog

Own = dict[str, DrivingRecord]


def queries(**kinds: int) -> list[Own]:
    """So many queries that the methods answer rightly, wrongly and differently; named by kind and number."""
    winners = {"right": (0, 0), "wrong": (1, 2), "mixed": (1, 0)}
    return [
        {
            method: replace(answer(0, winner, method), name=f"{kind} {k}")
            for method, winner in zip(("input", "normal"), winners[kind], strict=True)
        }
        for kind, count in kinds.items()
        for k in range(count)
    ]


def names(chosen: list[Own]) -> list[str]:
    return [own["input"].name for own in chosen]


def test_each_kind_has_its_part() -> None:
    every = queries(right=9, wrong=9, mixed=9)
    assert names(choose_queries(every, 6)) == ["mixed 0", "mixed 4", "wrong 0", "wrong 4", "right 0", "right 4"]
    assert names(choose_queries(every, 3)) == ["mixed 0", "wrong 0", "right 0"]
    # Of fewer, those come first that show a difference.
    assert names(choose_queries(every, 1)) == ["mixed 0"]
    assert choose_queries(every, 0) == []
    assert choose_queries([], 6) == []


def test_what_one_kind_lacks_the_next_ones_get() -> None:
    assert names(choose_queries(queries(right=8), 4)) == ["right 0", "right 2", "right 4", "right 6"]
    chosen = names(choose_queries(queries(right=9, mixed=1), 6))
    assert (chosen[0], len(chosen)) == ("mixed 0", 6)
    assert all(name.startswith("right") for name in chosen[1:])


@pytest.mark.parametrize("count", range(12))
def test_never_more_than_asked_for_and_none_twice(count: int) -> None:
    for kinds in ({"right": 2, "wrong": 7, "mixed": 4}, {"wrong": 1, "mixed": 20}, {"right": 5}):
        chosen = names(choose_queries(queries(**kinds), count))
        assert len(chosen) <= count
        assert len(set(chosen)) == len(chosen)


def test_where_an_answer_lies_in_words() -> None:
    frames = hand_drive().references
    assert outcome(frames[1], frames[1]) == "right"
    assert outcome(frames[1], frames[2]) == outcome(frames[2], frames[1]) == "1 moment off"
    assert outcome(frames[0], frames[3]) == "3 moments off"
    assert outcome(frames[0], frames[4]) == "another record"


@pytest.fixture(scope="module")
def asked() -> tuple[DriveTest, list[DrivingRecord]]:
    """A drive of three pairs, the dark pictures, brightened ones and daylight; the first method is not shown."""
    rows = methods(dim=Brighten(0.5), input=Input(), gamma_blind=GammaBlind(), normal=Normal())
    task = drive_test(noise_drive(3), rows)
    log: RecordLog[DrivingRecord] = RecordLog(None, DrivingRecord)
    measure_drive(task, log, Shard())
    return task, known_records(task, log)[0]


def drawn(path: Path) -> np.ndarray:
    with Image.open(path) as figure:
        return np.asarray(figure.convert("RGB"), dtype=int)


def test_a_line_per_query_and_a_column_per_method(asked: tuple, tmp_path: Path) -> None:
    task, records = asked
    write_figure_11(tmp_path / "one.png", records, task, 1)
    write_figure_11(tmp_path / "all.png", records, task, 9)
    one, every = drawn(tmp_path / "one.png"), drawn(tmp_path / "all.png")
    assert every.shape[0] == pytest.approx(3 * one.shape[0], rel=0.02)
    assert every.shape[1] == one.shape[1]
    # Queries stand on the left of their columns: the first is dark.
    height, third = one.shape[0], one.shape[1] // 3
    middle = one[height // 4 : height // 2].mean(2)
    means = [middle[:, third * k + third // 6 : third * k + third // 3].mean() for k in range(3)]
    assert means[0] < 0.85 * min(means[1:])
    # Matches that agree are green.
    green = (one[..., 1] > 180) & (one[..., 0] < 100) & (one[..., 2] < 130)
    assert [bool(green[:, third * k : third * (k + 1)].sum() > 100) for k in range(3)] == [True] * 3
    assert torch.is_grad_enabled()


def test_nothing_to_show(asked: tuple, tmp_path: Path) -> None:
    task, records = asked
    path = tmp_path / "none.png"
    write_figure_11(path, records, task, 0)
    write_figure_11(path, [], task, 6)
    nothing = [replace(one, counts=[0] * 3) for one in records]
    write_figure_11(path, nothing, task, 6)
    # Where one of the methods shown has no answer, the query is passed over.
    failed = [replace(one, counts=[], failure="why") if one.method == "input" else one for one in records]
    write_figure_11(path, failed, task, 6)
    assert not path.exists()
    # A method that is not shown may fail.
    write_figure_11(path, [replace(one, counts=[]) if one.method == "dim" else one for one in records], task, 1)
    assert path.exists()
