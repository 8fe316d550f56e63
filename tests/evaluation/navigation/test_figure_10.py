"""Figure 10: one line per row of the queries that tell most, in the dark where they were asked."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from made_noise import noise
from navigation_stubs import methods, trial
from PIL import Image

from diffnav.darkness import DarknessModel
from diffnav.data.maps.opening import open_maps
from diffnav.data.queries.darkened import darkened
from diffnav.data.queries.query import Query
from diffnav.enhancers.gamma_blind import GammaBlind
from diffnav.enhancers.input import Input
from diffnav.evaluation.contest import NamedMatcher
from diffnav.evaluation.navigation.figure_10 import write_figure_10
from diffnav.evaluation.navigation.measure import measure_navigation
from diffnav.evaluation.navigation.records import NavigationRecord
from diffnav.evaluation.navigation.searcher import Searcher, Tiles
from diffnav.evaluation.navigation.trial import Trial
from diffnav.evaluation.records import RecordLog
from diffnav.images import write_image
from diffnav.matching.matches import Features, Matches
from diffnav.matching.sift import Sift

# Of one line of the figure, at 80 dots an inch.
LINE_PX = 232


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Trial, list[Query], list[NavigationRecord]]:
    """Of three queries that SIFT finds, the second is a picture of elsewhere and the third cannot be read."""
    folder = tmp_path_factory.mktemp("figure")
    ground = noise((200, 300), 0)
    write_image(folder / "map.png", ground)
    maps = open_maps(folder / "map.png", bounds=[47.001, 8.0, 47.0, 8.002])
    write_image(folder / "a.png", ground[:, 40:140, 60:200])
    write_image(folder / "b.png", noise((100, 140), 1))
    (folder / "c.png").write_bytes(b"no picture")
    truth = tuple(float(value) for value in maps[0].georeference.latlon([129.5, 89.5]))
    queries = [darkened(Query(name, folder / f"{name}.png", truth), DarknessModel(gamma=(6, 6))) for name in "bca"]
    sift = NamedMatcher("sift", Sift(features=300))
    task = trial(
        folder,
        methods(input=Input(), gamma_blind=GammaBlind()),
        maps=maps,
        searchers=[Searcher("correlation", None, None), Searcher("exhaustive", sift, sift, tiles=Tiles((200, 300)))],
        conditions=["day", "dark"],
    )
    return task, queries, measure_navigation(queries, task, RecordLog(None, NavigationRecord))


def drawn(path: Path) -> np.ndarray:
    with Image.open(path) as figure:
        return np.asarray(figure.convert("RGB"), dtype=int)


def test_the_query_on_which_the_rows_disagree_comes_first(asked: tuple, tmp_path: Path):
    task, queries, records = asked
    found = [one.is_fix for one in records if (one.name, one.condition, one.mode) == ("a", "dark", "exhaustive")]
    assert found == [False, True]
    write_figure_10(tmp_path / "one.png", records, queries, task, 1)
    figure = drawn(tmp_path / "one.png")
    assert figure.shape == (2 * LINE_PX, 1040, 3)
    # The outline on the map is red, the box around its centre yellow: of the second line alone, on the right.
    red = (figure[..., 0] > 240) & (figure[..., 1:] < 60).all(-1)
    yellow = (figure[..., :2] > 220).all(-1) & (figure[..., 2] < 60)
    for mask in (red, yellow):
        rows, _ = np.nonzero(mask[:, 700:])
        assert len(rows) > 20
        assert rows.min() > LINE_PX
    # The first picture is as it was taken, dark; the second brightened.
    left = figure[:, 20:280]
    pictures = [left[top + 60 : top + 180].mean() for top in (0, LINE_PX)]
    assert pictures[1] > 1.5 * pictures[0]


def test_at_most_so_many_queries(asked: tuple, tmp_path: Path):
    task, queries, records = asked
    write_figure_10(tmp_path / "all.png", records, queries, task, 9)
    assert drawn(tmp_path / "all.png").shape[0] == 6 * LINE_PX
    write_figure_10(tmp_path / "none.png", records, queries, task, 0)
    assert not (tmp_path / "none.png").exists()


def test_more_lines_than_can_be_drawn_at_once_are_drawn_smaller(
    asked: tuple, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    task, queries, records = asked
    monkeypatch.setattr("diffnav.evaluation.navigation.figure_10._TALLEST_PX", 300)
    write_figure_10(tmp_path / "small.png", records, queries, task, 1)
    assert drawn(tmp_path / "small.png").shape[0] <= 300


def test_nothing_to_show(asked: tuple, tmp_path: Path):
    task, queries, records = asked
    unknown = [replace(record, has_truth=False) for record in records]
    away = [replace(record, on_map=False) for record in records]
    for none in (unknown, away, []):
        write_figure_10(tmp_path / "none.png", none, queries, task, 4)
    dense = replace(task, searchers=task.searchers[:1])
    write_figure_10(tmp_path / "none.png", records, queries, dense, 4)
    assert not (tmp_path / "none.png").exists()


class Fails(Sift):
    def match(self, a: Features, b: Features) -> Matches:  # noqa: ARG002
        raise RuntimeError("no memory left")


def test_a_matcher_that_failed_is_not_asked_again(asked: tuple, tmp_path: Path):
    task, queries, _ = asked
    matcher = NamedMatcher("sift", Fails(features=300))
    weak = replace(task, searchers=[replace(task.searchers[1], matcher=matcher)])
    records = measure_navigation(queries[2:], weak, RecordLog(None, NavigationRecord))
    assert {record.failure for record in records} == {"sift: no memory left"}
    write_figure_10(tmp_path / "figure.png", records, queries, weak, 1)
    assert drawn(tmp_path / "figure.png").shape[0] == 2 * LINE_PX
    assert torch.is_grad_enabled()
