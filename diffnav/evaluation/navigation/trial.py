"""What one worker of the navigation experiment does: every method and search on a flight's queries, one by one."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import torch

from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.queries.query import Query
from diffnav.errors import UserError
from diffnav.evaluation.methods import Method
from diffnav.evaluation.navigation.digests import code_digest, map_digest, query_digest
from diffnav.evaluation.navigation.known import Known
from diffnav.evaluation.navigation.pictures import AS_IT_IS, Pictures, conditions_of
from diffnav.evaluation.navigation.records import NavigationRecord, record_of
from diffnav.evaluation.navigation.searcher import Searcher
from diffnav.evaluation.predictions import PredictionCache
from diffnav.evaluation.runner import Runner
from diffnav.images import ImageError
from diffnav.navigation.fix import Fix
from diffnav.navigation.flight import Locates, follow
from diffnav.navigation.gates.gate import Gate, Never
from diffnav.navigation.preparation import Preparation
from diffnav.navigation.prior import Prior
from diffnav.navigation.track import Motion, Track

Flight = Sequence[Query]
# Method, matcher, mode, condition.
Labels = tuple[str, str, str, str]
_FAILURES = (UserError, ValueError, RuntimeError, MemoryError, cv2.error)


@dataclass(frozen=True)
class Trial:
    """Methods and searches that answer every query; a task for `spread`.

    gate: decides which pictures the methods brighten. conditions: day, dark or both, of each query that can be asked in
    both; empty: as the camera delivered it. features: folder of the maps' features. motion: of the vehicle, whose
    flights are then followed; None: each query is asked alone. known_keys: of the records that exist already.
    """

    maps: Sequence[GeoMap]
    methods: Sequence[Method]
    searchers: Sequence[Searcher]
    gate: Gate
    known: Known
    conditions: Sequence[str]
    features: Path
    cache: PredictionCache
    motion: Motion | None = None
    seed: int = 0
    known_keys: frozenset[str] = frozenset()

    def __call__(self, flight: Flight) -> Iterator[tuple[str, NavigationRecord | None]]:
        """(key, record) of each query, condition, method and search; None for a record that exists already.

        Raises: ImageError for a map that cannot be read; a query or method that fails is an answer without a fix.
        """
        keys = self._keys(flight)
        # A track needs all pictures of its flight: one answer that is missing, and all of its row are found again.
        missing = {self._row(labels) for own in keys for labels, key in own.items() if key not in self.known_keys}
        tracks = {row: Track(self.motion) for row in missing} if self.motion else {}
        for query, own in zip(flight, keys, strict=True):
            pictures, prior = self.pictures(query), self._prior(query)
            for labels, key in own.items():
                record = None
                if self._row(labels) in missing:
                    fix, failure = self._answer(pictures, prior, labels, tracks.get(self._row(labels)))
                    record = record_of(fix, query, key, labels, failure)
                yield key, None if key in self.known_keys else record

    def count(self, flight: Flight) -> int:
        """How many answers a flight gets."""
        lights = sum(len(conditions_of(query, self.conditions)) for query in flight)
        return lights * len(self.methods) * len(self.searchers)

    def pictures(self, query: Query) -> Pictures:
        """The query's pictures as the methods have them matched."""
        return Pictures(query, self._runners, self.gate)

    def _answer(self, pictures: Pictures, prior: Prior, labels: Labels, track: Track | None) -> tuple[Fix, str | None]:
        """(the answer, why there is none at all). Raises: ImageError for a map that cannot be read."""
        method, matcher, mode, condition = labels
        prepared, failure = pictures.prepared(condition, method)
        localizer = self._localizers[matcher, mode]
        try:
            with torch.no_grad():
                return follow(localizer, prepared, prior, track), failure
        except ImageError:
            raise
        except _FAILURES as error:
            failure = f"{matcher}: {' '.join(str(error).split()) or type(error).__name__}"
            fix = prepared.again().no_fix(failure)
            return (track.update(fix) if track else fix), failure

    def _keys(self, flight: Flight) -> list[dict[Labels, str]]:
        """The key of each answer, query by query; with a track it depends on all queries of the flight."""
        facts = [[query_digest(query), asdict(self._prior(query))] for query in flight]
        together = facts if self.motion else []
        return [
            {
                (method.name, searcher.matcher_name, searcher.mode, condition): self._key(
                    [own, together, condition], method, searcher
                )
                for condition in conditions_of(query, self.conditions)
                for method in self.methods
                for searcher in self.searchers
            }
            for query, own in zip(flight, facts, strict=True)
        ]

    def _key(self, own: list[Any], method: Method, searcher: Searcher) -> str:
        gate = Never() if method.name in AS_IT_IS else self.gate
        facts = [*self._shared_facts, *own, type(gate).__name__, dict(vars(gate))]
        facts += [method.name, method.fingerprint, searcher.matcher_name, searcher.fingerprint]
        return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()[:32]

    @cached_property
    def _shared_facts(self) -> list[Any]:
        motion = asdict(self.motion) if self.motion else None
        return [[map_digest(one) for one in self.maps], motion, code_digest(frozenset({__name__}))]

    def _row(self, labels: Labels) -> tuple[str, ...]:
        """What a track follows: by day and in the dark apart, unless the camera delivered some of each."""
        return labels if self.conditions else labels[:3]

    def _prior(self, query: Query) -> Prior:
        return self.known.prior(query, self.seed, self.maps)

    @cached_property
    def _runners(self) -> list[Runner]:
        return [Runner(method, self.cache) for method in self.methods]

    @cached_property
    def _localizers(self) -> dict[tuple[str, str], Locates]:
        """By matcher and mode; opened in the process that uses them: memory maps cannot be sent to another."""
        nothing = Preparation(Never(), lambda image: image)
        return {(one.matcher_name, one.mode): one.open(self.maps, self.features, nothing) for one in self.searchers}
