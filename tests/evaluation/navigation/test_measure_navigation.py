"""All answers, kept as they come: a second run asks nothing again, a stopped one goes on, processes change nothing."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch
from made_noise import noise
from navigation_stubs import StubSearcher, methods, photo_query, trial
from torch import nn

from diffnav.data.maps.opening import open_maps
from diffnav.data.queries.darkened import darkened
from diffnav.data.queries.query import Query
from diffnav.enhancers.gamma_blind import GammaBlind
from diffnav.enhancers.input import Input
from diffnav.evaluation.contest import NamedMatcher
from diffnav.evaluation.navigation.known import Known
from diffnav.evaluation.navigation.measure import measure_navigation
from diffnav.evaluation.navigation.records import NavigationRecord
from diffnav.evaluation.navigation.searcher import Searcher, Tiles
from diffnav.evaluation.navigation.trial import Trial
from diffnav.evaluation.predictions import PredictionCache
from diffnav.evaluation.records import RecordLog
from diffnav.images import write_image
from diffnav.matching.sift import Sift

Log = RecordLog[NavigationRecord]


def log_in(folder: Path) -> Log:
    return RecordLog(folder / "records.jsonl", NavigationRecord)


@pytest.fixture
def queries(tmp_path: Path) -> list[Query]:
    return [photo_query(tmp_path, name, seed) for seed, name in enumerate("abcd")]


def fresh(task: Trial) -> Trial:
    """The same task with searches that have been asked nothing."""
    return replace(task, searchers=[StubSearcher(one.matcher_name) for one in task.searchers])


def test_a_second_run_asks_nothing_and_returns_the_same(queries: list[Query], tmp_path: Path):
    task = trial(tmp_path, methods(input=Input(), net=GammaBlind()), searchers=[StubSearcher("x"), StubSearcher("y")])
    first = measure_navigation(queries, task, log_in(tmp_path))
    assert [(record.name, record.method, record.matcher) for record in first] == [
        (name, method, matcher) for name in "abcd" for method in ("input", "net") for matcher in "xy"
    ]
    log, again = log_in(tmp_path), fresh(task)
    assert measure_navigation(queries, again, log) == first
    assert log.reused == 16
    assert [searcher.asked for searcher in again.searchers] == [[], []]
    # One query more: it alone is asked.
    more = [photo_query(tmp_path, "e", 9), *queries]
    found = measure_navigation(more, again, log_in(tmp_path))
    assert [record.name for record in found[:4]] == ["e"] * 4
    assert found[4:] == first
    assert {name for name, _, _ in again.searchers[0].asked} == {"e"}


def test_a_stopped_run_goes_on_where_it_stood(queries: list[Query], tmp_path: Path):
    task = trial(tmp_path, methods(input=Input()))
    whole = measure_navigation(queries, task, log_in(tmp_path / "whole"))

    class Stopped(RecordLog[NavigationRecord]):
        def add(self, record: NavigationRecord) -> None:
            super().add(record)
            if record.name == "b":
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        measure_navigation(queries, fresh(task), Stopped(tmp_path / "records.jsonl", NavigationRecord))
    # Killed while it wrote.
    with (tmp_path / "records.jsonl").open("a") as file:
        file.write('{"key": "half')
    again, log = fresh(task), log_in(tmp_path)
    found = measure_navigation(queries, again, log)
    assert log.reused == 2
    assert [name for name, _, _ in again.searchers[0].asked] == ["c", "d"]
    assert [(record.name, record.key, record.answer["latitude"]) for record in found] == [
        (record.name, record.key, record.answer["latitude"]) for record in whole
    ]


def test_failures_are_tried_again(queries: list[Query], tmp_path: Path):
    weak = StubSearcher(fails={"c": RuntimeError("no memory left")})
    task = trial(tmp_path, methods(input=Input()), searchers=[weak])
    first = measure_navigation(queries, task, log_in(tmp_path))
    assert [record.is_fix for record in first] == [True, True, False, True]
    again = fresh(task)
    found = measure_navigation(queries, again, log_in(tmp_path))
    assert [record.is_fix for record in found] == [True] * 4
    assert [name for name, _, _ in again.searchers[0].asked] == ["c"]
    # The file now says so too.
    assert measure_navigation(queries, fresh(task), log_in(tmp_path)) == found


class Count(nn.Module):
    """Not even the picture is enhanced again that the cache holds."""

    calls = 0

    def forward(self, image: torch.Tensor, record: object = None) -> torch.Tensor:  # noqa: ARG002
        Count.calls += 1
        return image**0.5


def test_other_searches_share_the_enhanced_pictures(queries: list[Query], tmp_path: Path):
    Count.calls = 0
    task = trial(tmp_path, methods(net=Count()), cache=PredictionCache(tmp_path / "cache"))
    measure_navigation(queries, task, log_in(tmp_path))
    calls = Count.calls
    # Each once, and the first a second time, for the timing.
    assert calls == 5
    measure_navigation(queries, replace(task, searchers=[StubSearcher("new")]), log_in(tmp_path))
    assert Count.calls == calls


@pytest.fixture
def real(tmp_path: Path) -> tuple[Trial, list[Query]]:
    """A map of noise, four parts of it as photos, by day and dark, and SIFT."""
    ground = noise((240, 360), 0)
    write_image(tmp_path / "map.png", ground)
    maps = open_maps(tmp_path / "map.png", bounds=[47.001, 8.0, 47.0, 8.0022])
    queries = []
    for k, (top, left) in enumerate([(10, 10), (90, 200), (130, 40), (60, 120)]):
        path = tmp_path / f"{k}.png"
        write_image(path, ground[:, top : top + 100, left : left + 140])
        truth = maps[0].georeference.latlon([left + 69.5, top + 49.5])
        queries.append(darkened(Query(f"q{k}", path, (float(truth[0]), float(truth[1]))), dark=k % 2 == 1))
    sift = NamedMatcher("sift", Sift(features=300))
    searchers = [Searcher(mode, sift, sift, tiles=Tiles((160, 200), 0.3)) for mode in ("shortlist", "exhaustive")]
    rows = methods(input=Input(), gamma_blind=GammaBlind())
    cache = PredictionCache(tmp_path / "cache")
    return trial(tmp_path, rows, maps=maps, searchers=searchers, cache=cache, known=Known(radius_m=80)), queries


def told(records: list[NavigationRecord]) -> list[NavigationRecord]:
    """Records without times."""
    return [
        replace(record, seconds=0.0, answer=record.answer | {"milliseconds": sorted(record.answer["milliseconds"])})
        for record in records
    ]


def test_two_processes_give_what_one_gives(real: tuple[Trial, list[Query]], tmp_path: Path):
    task, queries = real
    alone = measure_navigation(queries, task, log_in(tmp_path / "one"))
    assert len(alone) == 16
    # Brightening helps in the dark and hurts by day, for both searches.
    located = {(record.method, record.condition) for record in alone if record.is_fix and record.error_m < 0.1}
    assert located == {("input", "day"), ("gamma_blind", "dark")}
    assert sum(record.is_fix for record in alone) == 8
    both = measure_navigation(queries, task, log_in(tmp_path / "two"), workers=2)
    assert told(both) == told(alone)
    # In whatever order they came, the file holds them all.
    log = log_in(tmp_path / "two")
    assert measure_navigation(queries, task, log, workers=2) == both
    assert log.reused == 16
