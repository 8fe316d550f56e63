"""What one worker of the driving experiment does: all methods and all matchers on one query after the other."""

import hashlib
import json
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from torch import Tensor

from diffnav.data.driving.driving_set import DrivingSet
from diffnav.data.pair_source import PairSource
from diffnav.data.pairs import WholePair
from diffnav.driving.answers import candidates
from diffnav.driving.rectified import matches_on_a_row
from diffnav.driving.shortlist import most_alike, picture_descriptor
from diffnav.errors import UserError
from diffnav.evaluation.contest import NamedMatcher
from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.driving.references import Reference, picture_key
from diffnav.evaluation.fingerprints import fingerprint
from diffnav.evaluation.match_records import Verify
from diffnav.evaluation.methods import Method
from diffnav.evaluation.predictions import PredictionCache, pair_digest
from diffnav.evaluation.runner import MethodError, Runner
from diffnav.matching.matches import Matches
from diffnav.matching.one_to_many import OneToMany, one_to_many

_FAILURES = (UserError, ValueError, RuntimeError, MemoryError, cv2.error)


@dataclass(frozen=True)
class DriveTest:
    """Methods and matchers on the queries of a drive; a task for `spread` over the queries' numbers.

    references: of the drive, in its order. pairs: how queries are darkened. darkness: the same as plain values.
    verify: of matches by a fundamental matrix, and verification: plain values that tell what it does. verified: how
    many references with the most matches are verified; 0: none. shortlist: so many references that look most alike
    are matched; None: all. known: keys of the records that exist already, which are not made again.
    """

    drive: DrivingSet
    references: Sequence[Reference]
    pairs: PairSource
    darkness: Mapping[str, Any]
    methods: Sequence[Method]
    matchers: Sequence[NamedMatcher]
    cache: PredictionCache
    verify: Verify
    verification: Mapping[str, Any]
    verified: int = 10
    shortlist: int | None = None
    longest_side: int | None = None
    known: frozenset[str] = field(default_factory=frozenset)

    @property
    def count(self) -> int:
        """How many records a query has."""
        return len(self.methods) * len(self.matchers)

    def __call__(self, number: int) -> Iterator[tuple[str, DrivingRecord | None]]:
        """(key, record, or None if one of this key exists already) for each method and matcher on one query."""
        query = self.drive.queries[number]
        keys = self.keys(number)
        missing = {label for label, key in keys.items() if key not in self.known}
        pair, problem = self._read(number) if missing else (None, None)
        for runner in self._runners:
            asked = [named for named in self.matchers if (runner.method.name, named.name) in missing]
            image, figures = self._enhanced(runner, pair, problem) if asked else (None, {})
            for named in self.matchers:
                label = runner.method.name, named.name
                record = None
                if label in missing:
                    own = figures if image is None else figures | self._answered(image, named)
                    record = DrivingRecord(
                        keys[label], *label, query.name, query.record, self.drive.truth[number], **own
                    )
                yield keys[label], record

    def keys(self, number: int) -> dict[tuple[str, str], str]:
        """(method, matcher) -> the key of its record of one query."""
        query = self.drive.queries[number]
        shared = [self.fingerprint, query.name, picture_key(query, self.longest_side)]
        return {
            (method.name, named.name): _digest([*shared, method.fingerprint, named.fingerprint])
            for method in self.methods
            for named in self.matchers
        }

    def matches(self, number: int, method: str, matcher: str, reference: int) -> tuple[WholePair, Tensor, Matches]:
        """(pair, picture as the method has it, its matches with a reference): for figures. Raises: UserError."""
        runner = next(one for one in self._runners if one.method.name == method)
        named = next(one for one in self.matchers if one.name == matcher)
        pair = self.pairs.read(self.drive.queries[number].photo(self.longest_side))
        try:
            image = runner.predict(pair, runner.key(pair_digest(pair))).image
        except MethodError as error:
            raise UserError(f"{method}: {error}") from None
        features = self.references[reference].features[matcher]
        return pair, image, named.matcher.match(named.matcher.features(image), features)

    @cached_property
    def fingerprint(self) -> str:
        """A hash of everything but query, method and matcher that decides a record."""
        facts = [
            dict(self.darkness), self.pairs.seed, self.longest_side, self.shortlist, self.verified,
            dict(self.verification), [picture_key(frame, self.longest_side) for frame in self.drive.references],
        ]  # fmt: skip
        return fingerprint(facts, {__name__})

    @cached_property
    def _runners(self) -> list[Runner]:
        return [Runner(method, self.cache) for method in self.methods]

    @cached_property
    def _others(self) -> dict[str, OneToMany]:
        """Matcher -> the references, prepared."""
        return {
            named.name: one_to_many(named.matcher, [one.features[named.name] for one in self.references])
            for named in self.matchers
        }

    @cached_property
    def _descriptors(self) -> np.ndarray:
        return np.stack([one.descriptor for one in self.references])

    def _read(self, number: int) -> tuple[WholePair | None, str | None]:
        try:
            return self.pairs.read(self.drive.queries[number].photo(self.longest_side)), None
        except UserError as error:
            return None, str(error)

    def _enhanced(
        self, runner: Runner, pair: WholePair | None, problem: str | None
    ) -> tuple[Tensor | None, dict[str, Any]]:
        """(the picture as a method shows it, what the record says of it); no picture where it failed."""
        if pair is None:
            return None, {"failure": problem}
        facts: dict[str, Any] = {"gamma": pair["record"].gamma if pair["record"] else None}
        try:
            prediction = runner.predict(pair, runner.key(pair_digest(pair)))
        except MethodError as error:
            return None, facts | {"failure": f"{runner.method.name}: {error}"}
        return prediction.image, facts | {"seconds_enhance": prediction.seconds}

    def _answered(self, image: Tensor, named: NamedMatcher) -> dict[str, Any]:
        """What the record says of one matcher on one picture."""
        try:
            others = self._others[named.name]
            times = [time.perf_counter()]
            features = named.matcher.features(image)
            times.append(time.perf_counter())
            asked, matches = self._matched(image, features, others, named)
            counts = [-1] * len(self.references)
            for reference, own in zip(asked, matches, strict=True):
                counts[reference] = len(own)
            times.append(time.perf_counter())
            place = {reference: k for k, reference in enumerate(asked)}
            verified = {k: matches[place[k]] for k in candidates(counts, self.verified)}
            inliers = [[k, int(self.verify(own).inliers.sum())] for k, own in verified.items()]
            rows = [[k, matches_on_a_row(own)] for k, own in verified.items()] if self.drive.rectified else []
            times.append(time.perf_counter())
        except _FAILURES as error:
            return {"failure": f"{named.name}: {' '.join(str(error).split()) or type(error).__name__}"}
        stages = ("seconds_features", "seconds_match", "seconds_verify")
        taken = {stage: b - a for stage, a, b in zip(stages, times[:-1], times[1:], strict=True)}
        return {"counts": counts, "inliers": inliers, "rows": rows, **taken}

    def _matched(
        self, image: Tensor, features: Any, others: OneToMany, named: NamedMatcher
    ) -> tuple[list[int], list[Matches]]:
        """Which references were matched, and the matches with each."""
        if self.shortlist is None:
            return list(range(len(self.references))), list(others.match_each(features))
        asked = most_alike(picture_descriptor(image), self._descriptors, self.shortlist)
        return asked, [named.matcher.match(features, self.references[k].features[named.name]) for k in asked]


def _digest(facts: list[str]) -> str:
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:32]
