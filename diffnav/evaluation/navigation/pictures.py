"""A query's picture as a method has it matched: by day or dark, as it is or enhanced, ready for a localizer."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial

from torch import Tensor

from diffnav.darkness import Darkening
from diffnav.data.pairs import WholePair
from diffnav.data.queries.darkened import BothLights, DarkenedQuery
from diffnav.data.queries.query import Query
from diffnav.evaluation.predictions import pair_digest
from diffnav.evaluation.runner import MethodError, Runner
from diffnav.images import ImageError
from diffnav.navigation.gates.gate import Gate, Never
from diffnav.navigation.preparation import Preparation, Prepared

# Rows that take the picture as it is: they need no gate.
AS_IT_IS = ("input", "normal")


def conditions_of(query: Query, asked: Sequence[str]) -> list[str]:
    """Day, dark or both, of those that are asked for; what the camera delivered where none is, or it has but one."""
    if not isinstance(query, DarkenedQuery):
        return ["day"]
    return list(asked) or ["dark" if query.dark else "day"]


class Pictures:
    """The pictures of one query: read, darkened and enhanced when they are first asked for."""

    def __init__(self, query: Query, runners: Sequence[Runner], gate: Gate) -> None:
        self.query, self.gate = query, gate
        self._runners = {runner.method.name: runner for runner in runners}
        # The last one alone: several of a large camera's would fill the memory.
        self._last: tuple[tuple[str, str], tuple[Prepared, str | None]] | None = None

    def prepared(self, condition: str, method: str) -> tuple[Prepared, str | None]:
        """(the picture as the method of that name has it matched by day or dark, why the method failed on it)."""
        wanted = condition, method
        if self._last is None or self._last[0] != wanted:
            self._last = wanted, self._prepare(condition, self._runners[method])
        return self._last[1]

    def _prepare(self, condition: str, runner: Runner) -> tuple[Prepared, str | None]:
        name = runner.method.name
        try:
            pair = self._pair(condition)
        except ImageError as error:
            return _unusable(self.query, str(error)), None
        taken: list[float] = []

        def enhance(_: Tensor) -> Tensor:
            prediction = runner.predict(pair, runner.key(pair_digest(pair)))
            taken.append(1000 * prediction.seconds)
            return prediction.image

        gate = Never() if name in AS_IT_IS else self.gate
        try:
            prepared = Preparation(gate, enhance)(_as_taken(self.query, pair["normal" if name == "normal" else "low"]))
        except MethodError as error:
            failure = f"{name}: {error}"
            return _unusable(self.query, failure), failure
        if taken:
            # Of the run that made it: from the cache it costs next to nothing.
            prepared.watch.milliseconds["enhance"] = taken[0]
        return prepared, None

    def _pair(self, condition: str) -> WholePair:
        """The picture by day or dark, its daylight picture beside it. Raises: ImageError."""
        low, record = self._day, None
        if isinstance(self.query, DarkenedQuery):
            # By day too it is known how dark the picture is: not at all.
            record = Darkening(1.0, self._day.max().item(), quality=0)
            if condition == "dark":
                low, record = self._both.dark, self._both.record
        return {"low": low, "normal": self._day, "name": self.query.name, "site": "", "record": record}

    @cached_property
    def _day(self) -> Tensor:
        return self.query.read_day() if isinstance(self.query, DarkenedQuery) else self.query.read()

    @cached_property
    def _both(self) -> BothLights:
        assert isinstance(self.query, DarkenedQuery)
        day = self._day
        return replace(self.query, image=lambda: day).read_both()


def _as_taken(query: Query, picture: Tensor) -> Query:
    """The query with this picture, whatever it was."""
    taken = replace(query, image=lambda: picture)
    return replace(taken, dark=False) if isinstance(taken, DarkenedQuery) else taken


def _unusable(query: Query, problem: str) -> Prepared:
    """A query without a picture, and why."""
    return Preparation(Never(), _nothing)(replace(query, image=partial(_fail, problem)))


def _fail(problem: str) -> Tensor:
    raise ImageError(problem)


def _nothing(image: Tensor) -> Tensor:
    return image
