"""Queries that follow each other: each search narrowed by what the track expects."""

from collections.abc import Sequence
from typing import Protocol

from diffnav.data.queries.query import Query
from diffnav.navigation.fix import Fix
from diffnav.navigation.preparation import Prepared
from diffnav.navigation.prior import Prior
from diffnav.navigation.track import Track


class Locates(Protocol):
    """A localizer or correlator."""

    def locate_prepared(self, prepared: Prepared, prior: Prior) -> Fix:
        """The answer to a query that was made ready."""
        ...


def follow(localizer: Locates, prepared: Prepared, prior: Prior, track: Track | None) -> Fix:
    """The answer to the next query of a flight, searched for where its track expects it, then everywhere.

    The second search lets a lost track find home; what jumps there is the track's to judge. Without a track it is the
    localizer's own answer.
    """
    if track is None:
        return localizer.locate_prepared(prepared.again(), prior)
    expected = prior.at(track.expected(prepared.facts["time"]))
    # One stopwatch: the answer took the time of both.
    attempt = prepared.again()
    fix = localizer.locate_prepared(attempt, expected)
    if fix.status != "fix" and expected != prior:
        fix = localizer.locate_prepared(attempt, prior)
    return track.update(fix)


def flights_of(queries: Sequence[Query]) -> list[list[Query]]:
    """The queries flight by flight, in their order; those without a flight stand alone."""
    flights: dict[str, list[Query]] = {}
    for number, query in enumerate(queries):
        flights.setdefault(query.flight or f"/{number}", []).append(query)
    return list(flights.values())
