"""What one worker of the matching experiment does: all methods and all matchers on one pair after the other."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import torch
from torch import nn

from diffnav.data.match_pairs.match_pair import MatchPair, MatchPairs
from diffnav.data.photos import Photo
from diffnav.errors import UserError
from diffnav.evaluation.fingerprints import fingerprint
from diffnav.evaluation.match_records import MatchRecord, Verify, find_matches, match_figures
from diffnav.evaluation.methods import Method
from diffnav.evaluation.predictions import PredictionCache, pair_digest
from diffnav.evaluation.provenance import processor_name
from diffnav.evaluation.runner import MethodError, Runner
from diffnav.matching.matches import Features, Matcher, Matches

_FAILURES = (UserError, ValueError, RuntimeError, MemoryError, cv2.error)
Job = tuple[MatchPairs, Photo]


@dataclass(frozen=True)
class NamedMatcher:
    """A matcher and what its rows are called."""

    name: str
    matcher: Matcher

    @cached_property
    def fingerprint(self) -> str:
        """A hash of settings (which name weights by their hash), code, libraries and device."""
        parts = [self.matcher, *vars(self.matcher).values()]
        devices = {processor_name(p.device) for net in parts if isinstance(net, nn.Module) for p in net.parameters()}
        facts = [type(self.matcher).__name__, dict(self.matcher.settings), sorted(devices)]
        return fingerprint(facts, {type(part).__module__ for part in parts})


@dataclass(frozen=True)
class Outcome:
    """What came of one method and matcher on one pair. record: None if one of this key existed already.

    problem: why the whole photo could not be used. cells: how many methods times matchers this settles.
    """

    method: str = ""
    matcher: str = ""
    key: str = ""
    record: MatchRecord | None = None
    problem: str | None = None
    cells: int = 1


@dataclass(frozen=True)
class Contest:
    """Methods and matchers that meet on every pair; a task for `spread`.

    verify: the verification of matches, and verification: plain values that tell what it does. known: keys of the
    records that exist already, which are not made again.

    Raises: UserError if the verification refuses its settings, or is not one by a homography.
    """

    methods: Sequence[Method]
    matchers: Sequence[NamedMatcher]
    verify: Verify
    verification: Mapping[str, Any]
    cache: PredictionCache
    known: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if self.verification.get("model", "homography") != "homography":
            raise UserError("verification.model must be homography here: the truth of every pair is one")
        nothing = torch.zeros(0, 2)
        self.verify(Matches(nothing, nothing, torch.zeros(0), "", {}))

    def __call__(self, job: Job) -> Iterator[Outcome]:
        """The outcomes of one photo; a method that needs to know how the picture was darkened, but cannot, has none."""
        source, photo = job
        try:
            pair = source.read(photo)
        except UserError as error:
            yield Outcome(problem=str(error), cells=len(self.methods) * len(self.matchers))
            return
        digests = pair_digest(pair.pair), pair.digest()
        references = _References(pair, self._warm)
        for runner in self._runners:
            if runner.method.needs_record and pair.pair["record"] is None:
                yield Outcome(runner.method.name, cells=len(self.matchers))
                continue
            keys = self._keys(runner, *digests)
            missing = [named for named in self.matchers if keys[named.name] not in self.known]
            figures = self._measure(runner, pair, runner.key(digests[0]), missing, references) if missing else {}
            for name, key in keys.items():
                labels = (key, runner.method.name, name, source.kind, photo.name, photo.site)
                record = MatchRecord(*labels, **figures[name]) if name in figures else None
                yield Outcome(runner.method.name, name, key, record)

    @cached_property
    def fingerprint(self) -> str:
        """A hash of everything that turns matches into a record."""
        return fingerprint(dict(self.verification), {MatchRecord.__module__, "diffnav.matching.verification"})

    @cached_property
    def _runners(self) -> list[Runner]:
        return [Runner(method, self.cache) for method in self.methods]

    @cached_property
    def _warm(self) -> set[str]:
        """The matchers that have run in this process."""
        return set()

    def _keys(self, runner: Runner, picture: str, pair: str) -> dict[str, str]:
        """Matcher -> the key of its record."""
        shared = f"{runner.key(picture)}/{pair}/{self.fingerprint}"
        return {m.name: hashlib.sha256(f"{shared}/{m.fingerprint}".encode()).hexdigest()[:32] for m in self.matchers}

    def _measure(
        self, runner: Runner, pair: MatchPair, key: str, matchers: Sequence[NamedMatcher], references: "_References"
    ) -> dict[str, dict[str, Any]]:
        """Matcher -> the fields of its record that follow from the pictures."""
        record, image = pair.pair["record"], pair.pair["low"]
        facts: dict[str, Any] = {"gamma": record.gamma if record else None}
        try:
            prediction = runner.predict(pair.pair, key)
            image = prediction.image
            facts |= {"seconds_enhance": prediction.seconds, "device": prediction.device}
        except MethodError as error:
            facts["failure"] = str(error)
        query = pair.query(image)
        facts |= {"height": query.shape[1], "width": query.shape[2]}
        figures = {}
        for named in matchers:
            try:
                reference = references.of(named)
                found = find_matches(pair, query, named.matcher, reference)
                own = match_figures(pair, found, reference, self.verify)
            except _FAILURES as error:
                own = {"failure": f"{named.name}: {' '.join(str(error).split()) or type(error).__name__}"}
            figures[named.name] = facts | own
        return figures


class _References:
    """The features of one pair's reference, found once per matcher, when they are first asked for."""

    def __init__(self, pair: MatchPair, warm: set[str]) -> None:
        self._pair = pair
        self._warm = warm
        self._features: dict[str, Features] = {}

    def of(self, named: NamedMatcher) -> Features:
        if named.name not in self._features:
            features = named.matcher.features(self._pair.reference)
            if named.name not in self._warm:
                # The first run of all loads and prepares things that no later one pays for.
                named.matcher.match(features, features)
                self._warm.add(named.name)
            self._features[named.name] = features
        return self._features[named.name]
