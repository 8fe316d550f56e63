"""Flights are followed row by row, and what is known of them already is not asked again."""

from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

from navigation_stubs import Brighten, StubSearcher, answers, methods, photo_query, trial

from diffnav.data.queries.darkened import darkened
from diffnav.data.queries.query import Query
from diffnav.enhancers.input import Input
from diffnav.navigation.track import Motion


def flight_of(folder: Path, count: int, **facts) -> list[Query]:
    start = datetime(2020, 1, 1)
    return [
        photo_query(folder, f"f{k}", k, flight="f", time=start + timedelta(seconds=k), **facts) for k in range(count)
    ]


def test_flights_are_followed_row_by_row(tmp_path: Path):
    queries = flight_of(tmp_path, 4)
    first, second = StubSearcher("first", fails={"f2": ValueError("lost")}), StubSearcher("second")
    task = trial(tmp_path, methods(input=Input()), searchers=[first, second], motion=Motion())
    records = {(record.name, record.matcher): record for record in answers(task, queries)}
    # What the track expects bridges the gap; the failure is not forgotten over it.
    assert records["f2", "first"].answer["status"] == "coasted"
    assert records["f2", "first"].failure == "first: lost"
    assert {record.answer["status"] for key, record in records.items() if key != ("f2", "first")} == {"fix"}
    priors = [prior for _, _, prior in second.asked]
    assert priors[0].place is None
    assert all(prior.place is not None for prior in priors[1:])


def test_a_camera_that_delivers_some_of_each_flies_one_flight(tmp_path: Path):
    queries = [darkened(query, dark=k % 2 == 1) for k, query in enumerate(flight_of(tmp_path, 4))]
    searcher = StubSearcher()
    answers(trial(tmp_path, methods(input=Input()), searchers=[searcher], motion=Motion()), queries)
    assert [prior.place is not None for _, _, prior in searcher.asked] == [False, True, True, True]
    searcher = StubSearcher()
    both = trial(tmp_path, methods(input=Input()), searchers=[searcher], motion=Motion(), conditions=["day", "dark"])
    answers(both, queries)
    # Asked twice: each row has a track of its own.
    assert [prior.place is not None for _, _, prior in searcher.asked] == [False] * 2 + [True] * 6


def test_what_is_known_is_not_asked_again(tmp_path: Path):
    queries = [photo_query(tmp_path, name, seed) for seed, name in enumerate("ab")]
    net = Brighten()
    task = trial(tmp_path, methods(input=Input(), net=net), searchers=[StubSearcher("one"), StubSearcher("two")])
    keys = {query.name: [key for key, _ in task([query])] for query in queries}
    assert len({key for own in keys.values() for key in own}) == 8
    calls = net.calls
    again = replace(task, known_keys=frozenset(keys["a"] + keys["b"][:3]), searchers=[
        StubSearcher("one"), StubSearcher("two"),
    ])  # fmt: skip
    assert [record for _, record in again([queries[0]])] == [None] * 4
    assert net.calls == calls
    found = list(again([queries[1]]))
    assert [key for key, _ in found] == keys["b"]
    assert [record is None for _, record in found] == [True, True, True, False]
    assert [len(searcher.asked) for searcher in again.searchers] == [0, 1]


def test_a_row_that_is_not_whole_is_followed_again(tmp_path: Path):
    queries = flight_of(tmp_path, 3)
    task = trial(
        tmp_path, methods(input=Input()), searchers=[StubSearcher("one"), StubSearcher("two")], motion=Motion()
    )
    first = list(task(queries))
    known = frozenset(key for key, record in first if (record.name, record.matcher) != ("f2", "two"))
    searchers = [StubSearcher("one"), StubSearcher("two")]
    second = list(replace(task, known_keys=known, searchers=searchers)(queries))
    assert [key for key, _ in second] == [key for key, _ in first]
    (record,) = [record for _, record in second if record]
    assert (record.name, record.matcher, record.error_m) == ("f2", "two", first[-1][1].error_m)
    assert [len(searcher.asked) for searcher in searchers] == [0, 3]
