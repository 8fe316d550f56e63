"""An answer is found again where nothing has changed that decides it, and only there."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from made_noise import noise
from navigation_stubs import StubSearcher, methods, photo_query, stub_map, trial

from diffnav.data.queries.darkened import darkened
from diffnav.data.queries.query import Query
from diffnav.enhancers.gamma_blind import GammaBlind
from diffnav.enhancers.input import Input
from diffnav.enhancers.normal import Normal
from diffnav.evaluation.methods import Method
from diffnav.evaluation.navigation.known import Known
from diffnav.evaluation.navigation.trial import Trial
from diffnav.evaluation.predictions import PredictionCache
from diffnav.geometry.georeference import AffineGeoreference, LocalMetres
from diffnav.images import write_image
from diffnav.navigation.gates.gate import BenefitGate, DefinitionGate, Never
from diffnav.navigation.track import Motion

Change = Callable[[Trial], Trial]


@pytest.fixture
def query(tmp_path: Path) -> Query:
    return photo_query(tmp_path, "a", heading_deg=10.0, ground_sample_distance_m=0.5)


@pytest.fixture
def task(tmp_path: Path) -> Trial:
    return trial(tmp_path, methods(net=GammaBlind()), gate=DefinitionGate(5.0))


def key_of(task: Trial, flight: list[Query], row: int = 0) -> str:
    return [key for key, _ in task(flight)][row]


def moved(task: Trial) -> Trial:
    """The map's picture is the same, its world file was corrected by a pixel."""
    georeference = AffineGeoreference((60, 80), LocalMetres((47.0, 8.0)), (0.5, 0.0, 0.5, 0.0, -0.5, 0.0))
    return replace(task, maps=[replace(task.maps[0], georeference=georeference)])


@pytest.mark.parametrize(
    "change",
    [
        lambda task: replace(task, maps=[stub_map(fingerprint="other content")]),
        lambda task: replace(task, maps=[stub_map("other_name")]),
        lambda task: replace(task, maps=[stub_map(), stub_map("second")]),
        moved,
        lambda task: replace(task, methods=[Method("net", GammaBlind(2.0).eval(), {"gamma": 2.0})]),
        lambda task: replace(task, methods=methods(renamed=GammaBlind())),
        lambda task: replace(task, searchers=[StubSearcher(fingerprint="2")]),
        lambda task: replace(task, searchers=[StubSearcher("renamed")]),
        lambda task: replace(task, gate=DefinitionGate(6.0)),
        lambda task: replace(task, gate=BenefitGate(5.0)),
        lambda task: replace(task, gate=Never()),
        lambda task: replace(task, known=Known(radius_m=50)),
        lambda task: replace(task, known=Known(heading=True)),
        lambda task: replace(task, known=Known(scale=True)),
        lambda task: replace(task, known=Known(radius_m=50, place=[47, 8])),
        lambda task: replace(task, motion=Motion()),
    ],
)
def test_what_decides_an_answer_changes_its_key(change: Change, task: Trial, query: Query):
    assert key_of(change(task), [query]) != key_of(task, [query])


@pytest.mark.parametrize(
    "change",
    [
        lambda task: replace(task, seed=1),
        lambda task: replace(task, features=Path("elsewhere")),
        lambda task: replace(task, cache=PredictionCache(None)),
        lambda task: replace(task, known=Known(heading_offset_deg=3.0, ground_sample_distance_m=0.2)),
        lambda task: replace(task, conditions=["day", "dark"]),
        lambda task: replace(task, methods=[*task.methods, *methods(more=Input())]),
        lambda task: replace(task, searchers=[*task.searchers, StubSearcher("more")]),
        lambda task: replace(task, known_keys=frozenset(["another"])),
    ],
)
def test_what_does_not_leaves_it(change: Change, task: Trial, query: Query):
    assert key_of(change(task), [query]) == key_of(task, [query])


def test_settings_of_the_prior_and_of_motion(task: Trial, query: Query):
    priors = [Known(radius_m=50), Known(radius_m=60), Known(heading=True), Known(heading=True, heading_offset_deg=2.0)]
    tasks = [replace(task, known=known) for known in priors] + [replace(task, known=Known(radius_m=50), seed=1)]
    tasks += [replace(task, motion=motion) for motion in (Motion(), Motion(speed_m_s=30.0))]
    assert len({key_of(one, [query]) for one in tasks}) == 7


def test_rows_that_take_the_picture_as_it_is_ask_no_gate(tmp_path: Path, query: Query):
    for name, enhancer in (("input", Input()), ("normal", Normal())):
        one, other = (
            trial(tmp_path, methods(**{name: enhancer}), gate=gate) for gate in (DefinitionGate(5.0), Never())
        )
        assert key_of(one, [query]) == key_of(other, [query])


def test_the_truth_corrected_or_the_photo_replaced(task: Trial, query: Query, tmp_path: Path):
    before = key_of(task, [query])
    assert key_of(task, [replace(query, truth=(47.0, 8.1))]) != before
    assert key_of(task, [replace(query, on_map=False)]) != before
    write_image(tmp_path / "a.png", noise((48, 64), 5))
    assert key_of(task, [query]) != before


def test_day_and_dark(task: Trial, query: Query):
    both = replace(task, conditions=["day", "dark"])
    keys = [key for key, _ in both([darkened(query)])]
    assert len(set(keys)) == 2
    # Which of them the camera delivered does not matter where both are asked for: the query's own facts do.
    assert key_of(replace(task, conditions=["dark"]), [darkened(query)]) == keys[1]


def test_the_other_pictures_of_a_flight_count_where_it_is_followed(task: Trial, query: Query, tmp_path: Path):
    flight = [replace(query, flight="f"), photo_query(tmp_path, "b", 1, flight="f")]
    longer = [*flight, photo_query(tmp_path, "c", 2, flight="f")]
    assert key_of(task, flight) == key_of(task, longer)
    followed = replace(task, motion=Motion())
    assert key_of(followed, flight) != key_of(followed, longer)
    assert key_of(followed, flight) != key_of(followed, flight[::-1], 1)
