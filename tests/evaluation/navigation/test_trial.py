"""One worker's answers: which picture each row sees, what its gate decides, what a failure leaves."""

from pathlib import Path

import pytest
import torch
from made_noise import noise
from navigation_stubs import Brighten, StubSearcher, answers, methods, photo_query, stub_map, trial
from torch import Tensor

from diffnav.darkness import DarknessModel
from diffnav.data.queries.darkened import darkened
from diffnav.data.queries.query import Query
from diffnav.enhancers.gamma_oracle import GammaOracle
from diffnav.enhancers.input import Input
from diffnav.enhancers.normal import Normal
from diffnav.evaluation.navigation.known import Known
from diffnav.images import ImageError, write_image
from diffnav.navigation.gates.definition import definition
from diffnav.navigation.gates.gate import Always, DefinitionGate, Never


def test_each_row_sees_its_picture_and_the_gate_decides(tmp_path: Path):
    query = darkened(photo_query(tmp_path, "a"), DarknessModel(gamma=(4, 4)))
    both = query.read_both()
    day, dark = both.day, both.dark
    between = DefinitionGate((definition(day).item() + definition(dark).item()) / 2)
    assert definition(dark) < definition(day)
    searcher = StubSearcher()
    rows = methods(input=Input(), net=Brighten(), gamma_oracle=GammaOracle(), normal=Normal())
    task = trial(tmp_path, rows, searchers=[searcher], gate=between, conditions=["day", "dark"])
    found = {(record.method, record.condition): record for record in answers(task, [query])}
    seen = dict(zip(found, [mean for _, mean, _ in searcher.asked], strict=True))
    expected = {
        ("input", "day"): day,
        ("net", "day"): day,
        ("normal", "day"): day,
        ("input", "dark"): dark,
        ("net", "dark"): dark**0.25,
        ("normal", "dark"): day,
    }
    assert {key: seen[key] for key in expected} == pytest.approx(
        {key: picture.mean().item() for key, picture in expected.items()}, abs=2e-3
    )
    # What Eq. 9 inverted leaves is the loss by 8 bit.
    assert seen["gamma_oracle", "dark"] == pytest.approx(day.mean().item(), abs=0.05)
    assert {key for key, record in found.items() if record.answer["enhanced"]} == {
        ("net", "dark"), ("gamma_oracle", "dark"),
    }  # fmt: skip
    assert found["net", "dark"].answer["definition"] == pytest.approx(definition(dark).item())
    assert found["net", "dark"].answer["milliseconds"]["enhance"] > 0


def test_gates_that_decide_alike_for_all(tmp_path: Path):
    query = darkened(photo_query(tmp_path, "a"), DarknessModel(gamma=(4, 4)))
    both = query.read_both()
    rows = methods(input=Input(), net=Brighten(), gamma_oracle=GammaOracle(), normal=Normal())
    for gate, by_day in ((Always(), both.day**0.25), (Never(), both.day)):
        searcher = StubSearcher()
        task = trial(tmp_path, rows, searchers=[searcher], gate=gate, conditions=["day"])
        assert all(record.failure is None for record in answers(task, [query]))
        means = [mean for _, mean, _ in searcher.asked]
        # By day nothing was darkened: who knows that leaves the picture as it is.
        day = both.day.mean().item()
        assert means == pytest.approx([day, by_day.mean().item(), day, day], abs=2e-3)


def test_as_the_camera_delivered_it(tmp_path: Path):
    query = photo_query(tmp_path, "a")
    task = trial(tmp_path, methods(input=Input()))
    flights = [query, darkened(query, dark=True), darkened(query, dark=False)]
    assert [answers(task, [one])[0].condition for one in flights] == ["day", "dark", "day"]
    assert [task.count([one]) for one in flights] == [1, 1, 1]
    both = trial(tmp_path, methods(input=Input(), net=Brighten()), conditions=["day", "dark"])
    # A plain photo has no dark picture.
    assert [both.count([one]) for one in flights] == [2, 4, 4]
    assert [len(answers(both, [one])) for one in flights] == [2, 4, 4]


def test_a_made_picture_is_made_once(tmp_path: Path):
    made = []

    def picture() -> Tensor:
        made.append(1)
        return noise((48, 64), 0)

    query = darkened(Query("a", picture))
    task = trial(tmp_path, methods(input=Input(), normal=Normal()), conditions=["day", "dark"])
    assert len(answers(task, [query])) == 4
    assert len(made) == 1


def test_pictures_that_cannot_be_used_are_answers_and_the_batch_goes_on(tmp_path: Path):
    small = tmp_path / "small.png"
    good = photo_query(tmp_path, "good")
    torch.save({}, tmp_path / "broken.png")
    (tmp_path / "cut.png").write_bytes(good.image.read_bytes()[:500])
    write_image(small, noise((31, 64), 0))
    write_image(tmp_path / "black.png", torch.zeros(3, 48, 64))
    names = ["missing", "broken", "cut", "small", "black"]
    flight = [Query(name, tmp_path / f"{name}.png", (47.0, 8.0)) for name in names] + [good]
    task = trial(tmp_path, methods(input=Input(), net=Brighten()))
    records = {record.name: record for one in flight for record in answers(task, [one]) if record.method == "net"}
    assert [record.answer["status"] for record in records.values()] == ["no_fix"] * 5 + ["fix"]
    assert not any(record.is_usable for name, record in records.items() if name != "good")
    for name, part in (
        ("missing", "missing.png"), ("broken", "broken.png"), ("cut", "cut.png"), ("small", "fewer than 32"),
        ("black", "of one colour"),
    ):  # fmt: skip
        (reason,) = records[name].answer["reasons"]
        assert part in reason
        # Nothing failed: the next run would find the same.
        assert records[name].failure is None


def test_a_method_that_fails_leaves_the_others_alone(tmp_path: Path):
    rows = methods(input=Input(), net=Brighten(fails=True), normal=Normal())
    found = {record.method: record for record in answers(trial(tmp_path, rows), [photo_query(tmp_path, "a")])}
    assert [record.is_fix for record in found.values()] == [True, False, True]
    assert found["net"].failure == "net: out of memory"
    assert found["net"].answer["reasons"] == ["net: out of memory"]


@pytest.mark.parametrize("error", [RuntimeError("no  memory\nleft"), ValueError("no memory left"), MemoryError()])
def test_a_search_that_fails_on_one_picture(error: Exception, tmp_path: Path):
    searchers = [StubSearcher("weak", fails={"b": error}), StubSearcher("strong")]
    task = trial(tmp_path, methods(input=Input()), searchers=searchers)
    queries = [photo_query(tmp_path, name, seed) for seed, name in enumerate("abc")]
    records = [record for query in queries for record in answers(task, [query])]
    assert [(record.name, record.matcher, record.is_fix) for record in records] == [
        ("a", "weak", True), ("a", "strong", True), ("b", "weak", False), ("b", "strong", True), ("c", "weak", True),
        ("c", "strong", True),
    ]  # fmt: skip
    failed = records[2]
    assert failed.failure in ("weak: no memory left", "weak: MemoryError")
    assert list(failed.answer["reasons"]) == [failed.failure]
    assert failed.is_usable


def test_an_unreadable_map_ends_it(tmp_path: Path):
    task = trial(tmp_path, methods(input=Input()), searchers=[StubSearcher(fails={"a": ImageError("map.png: gone")})])
    with pytest.raises(ImageError, match=r"map.png: gone"):
        answers(task, [photo_query(tmp_path, "a")])


def test_the_prior_is_told(tmp_path: Path):
    searcher = StubSearcher()
    task = trial(tmp_path, methods(input=Input()), searchers=[searcher], known=Known(radius_m=30, heading=True))
    answers(task, [photo_query(tmp_path, "a", heading_deg=12.0)])
    answers(task, [photo_query(tmp_path, "off", on_map=False, truth=None)])
    (_, _, on), (_, _, off) = searcher.asked
    assert (on.radius_m, on.heading_deg) == (30, 12)
    x, y = stub_map().georeference.pixels(off.place)
    assert -0.5 <= x <= 79.5
    assert -0.5 <= y <= 59.5
