"""A query made ready for matching: read, and brightened where a gate says so."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from torch import Tensor

from diffnav.data.queries.query import Query
from diffnav.images import ImageError
from diffnav.navigation.fix import Fix
from diffnav.navigation.gates.gate import Gate
from diffnav.navigation.stopwatch import Stopwatch

# Pictures smaller than this, or without two levels of 8 bit in a channel, hold nothing to match.
_SMALLEST_PX = 32
_LEAST_CONTRAST = 0.5 / 255


@dataclass(frozen=True)
class Prepared:
    """A query's picture (3, H, W) as it will be matched, None where it cannot be; facts: fields of its `Fix` so far."""

    image: Tensor | None
    facts: dict[str, Any]
    watch: Stopwatch

    def again(self) -> "Prepared":
        """The same with a stopwatch of its own, so that several localizers may answer."""
        watch = Stopwatch()
        watch.milliseconds |= self.watch.milliseconds
        return Prepared(self.image, self.facts | {"milliseconds": watch.milliseconds}, watch)

    def no_fix(self, *reasons: str, **facts: Any) -> Fix:
        """The answer without a place."""
        return Fix(**({"status": "no_fix", "reasons": reasons} | self.facts | facts))


@dataclass(frozen=True)
class Preparation:
    """Reads queries; what `gate` takes for dark, `enhance`, (3, H, W) -> the same, brightens."""

    gate: Gate
    enhance: Callable[[Tensor], Tensor]

    def __call__(self, query: Query) -> Prepared:
        """A picture that cannot be read or used is a fact, not an error."""
        watch = Stopwatch()
        facts = {"query": query.name, "time": query.time, "flight": query.flight, "milliseconds": watch.milliseconds}
        try:
            with watch.stage("read"):
                image = query.read()
            _require_content(query.name, image)
        except ImageError as error:
            return Prepared(None, facts | {"reasons": (str(error),)}, watch)
        with watch.stage("gate"):
            enhanced, measured = self.gate.enhances(image)
        if enhanced:
            with watch.stage("enhance"):
                image = self.enhance(image)
        return Prepared(image, facts | {"enhanced": enhanced, "definition": measured.get("definition")}, watch)


def _require_content(name: str, image: Tensor) -> None:
    """Raise ImageError for a picture in which nothing could be matched."""
    height, width = image.shape[1:]
    if min(height, width) < _SMALLEST_PX:
        raise ImageError(f"{name}: {width} x {height} pixels, fewer than {_SMALLEST_PX} a side; give a larger picture")
    if float((image.amax((1, 2)) - image.amin((1, 2))).max()) < _LEAST_CONTRAST:
        raise ImageError(f"{name}: the picture is of one colour; nothing in it can be matched")
