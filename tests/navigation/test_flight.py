"""Queries that follow each other: each search narrowed by the track, then everywhere."""

from dataclasses import dataclass, field
from datetime import datetime, timedelta

import torch
from made_maps import ORIGIN, metres_from

from diffnav.data.queries.query import Query
from diffnav.navigation.fix import Fix
from diffnav.navigation.flight import flights_of, follow
from diffnav.navigation.gates.gate import Never
from diffnav.navigation.preparation import Preparation, Prepared
from diffnav.navigation.prior import NOTHING, Prior
from diffnav.navigation.track import Track

START = datetime(2024, 5, 1)


@dataclass
class Scripted:
    """Answers that are found within the prior alone, or only without one."""

    answers: list[Fix]
    priors: list[Prior] = field(default_factory=list)
    found_only_everywhere: bool = False

    def locate_prepared(self, prepared: Prepared, prior: Prior) -> Fix:
        self.priors.append(prior)
        with prepared.watch.stage("match"):
            answer = self.answers[0]
        if self.found_only_everywhere and prior.place is not None:
            return prepared.no_fix("not where it was expected")
        place = {"latitude": answer.latitude, "longitude": answer.longitude, "sigma_m": answer.sigma_m}
        return Fix(status=answer.status, **place, **prepared.facts)


def fix_of(longitude: float) -> Fix:
    return Fix("", "fix", latitude=47.0, longitude=longitude, sigma_m=1.0)


def prepared_at(seconds: float, name: str = "photo") -> Prepared:
    picture = torch.rand(3, 40, 40, generator=torch.Generator().manual_seed(1))
    query = Query(name, lambda: picture, time=START + timedelta(seconds=seconds))
    return Preparation(Never(), lambda image: image)(query)


def test_without_a_track_it_is_the_localizers_answer() -> None:
    localizer, prior = Scripted([fix_of(8.0)]), Prior(heading_deg=30.0)
    prepared = prepared_at(0)
    fix = follow(localizer, prepared, prior, None)
    assert fix.status == "fix"
    assert localizer.priors == [prior]
    assert "match" not in prepared.watch.milliseconds


def test_the_first_is_searched_everywhere_the_next_around_what_is_expected() -> None:
    localizer, track = Scripted([fix_of(8.0)]), Track()
    follow(localizer, prepared_at(0), NOTHING, track)
    follow(localizer, prepared_at(1), Prior(heading_deg=30.0), track)
    assert localizer.priors[0] == NOTHING
    second = localizer.priors[1]
    assert len(localizer.priors) == 2
    assert second.heading_deg == 30
    assert second.place is not None
    assert metres_from(ORIGIN, second.place) == (0, 0)
    # 20 m/s for a second and 3 m of a fix, four times, and the fix's own.
    assert 80 < (second.radius_m or 0) < 110


def test_a_place_of_its_own_counts_more_than_the_tracks() -> None:
    localizer, track, prior = Scripted([fix_of(8.0)]), Track(), Prior((47.0, 8.0), 500.0)
    for k in range(2):
        follow(localizer, prepared_at(k), prior, track)
    assert localizer.priors == [prior, prior]


def test_what_is_not_found_where_it_is_expected_is_searched_everywhere() -> None:
    localizer, track = Scripted([fix_of(8.0)], found_only_everywhere=True), Track()
    prior = Prior(heading_deg=30.0)
    assert follow(localizer, prepared_at(0), prior, track).status == "fix"
    fix = follow(localizer, prepared_at(1), prior, track)
    assert [one.place for one in localizer.priors] == [None, (47.0, 8.0), None]
    assert localizer.priors[2] == prior
    assert (fix.status, fix.latitude, fix.longitude) == ("fix", 47.0, 8.0)


def test_the_time_of_both_searches_counts() -> None:
    """The stopwatch adds up what the same stage takes; the query's own is not touched."""
    localizer, track = Scripted([fix_of(8.0)], found_only_everywhere=True), Track()
    follow(localizer, prepared_at(0), NOTHING, track)
    turns: list[str] = []
    prepared = prepared_at(1)
    again = prepared.again

    def counted() -> Prepared:
        turns.append("again")
        return again()

    object.__setattr__(prepared, "again", counted)
    fix = follow(localizer, prepared, NOTHING, track)
    assert turns == ["again"]
    assert fix.milliseconds["match"] > 0
    assert "match" not in prepared.watch.milliseconds


def test_what_jumps_is_the_tracks_to_judge() -> None:
    track = Track()
    for k in range(5):
        follow(Scripted([fix_of(8.0)]), prepared_at(k), NOTHING, track)
    far = follow(Scripted([fix_of(8.1)], found_only_everywhere=True), prepared_at(5), NOTHING, track)
    assert far.status == "coasted"
    (reason,) = far.reasons
    assert reason.startswith("jumps 75")
    unseen = follow(Scripted([Fix("", "no_fix")]), prepared_at(6), NOTHING, track)
    assert unseen.status == "coasted"
    assert unseen.query == "photo"


def test_flights_keep_their_order_and_the_rest_stand_alone() -> None:
    def query(name: str, flight: str = "") -> Query:
        return Query(name, lambda: torch.zeros(3, 40, 40), flight=flight)

    queries = [query("a", "one"), query("b"), query("c", "two"), query("d", "one"), query("e"), query("f", "two")]
    assert [[one.name for one in flight] for flight in flights_of(queries)] == [["a", "d"], ["b"], ["c", "f"], ["e"]]
    assert flights_of([]) == []
