"""Pairs of street pictures by two cameras of one car: one flat description that every driving set is brought to."""

import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from torch import Tensor

from diffnav.data.photos import Photo
from diffnav.errors import UserError
from diffnav.images import read_image, shrink

Position = tuple[float, float, float]


@dataclass(frozen=True)
class Frame:
    """One picture of one camera.

    name: unique among its camera's. picture: its file, or a function that renders it. camera: which one. record:
    the drive or recording that it belongs to. moment: what it shares with its partner, a frame number or a time
    stamp. time_s: seconds from an origin that its record shares; None if unknown. position_m: x, y, z of the camera,
    or of the rig where the data set tells no more; None if unknown. world: whose origin and axes position_m has.
    index: place of its moment among its record's, those without a pair counted: neighbours differ by 1.
    """

    name: str
    picture: Path | Callable[[], Tensor]
    camera: str
    record: str
    moment: str
    time_s: float | None = None
    position_m: Position | None = None
    world: str = ""
    index: int = 0

    def read(self, longest_side: int | None = None) -> Tensor:
        """The picture, (3, H, W) in [0, 1]; grey becomes three equal channels; a larger one is shrunk to that side.

        Raises: ImageError.
        """
        picture = read_image(self.picture) if isinstance(self.picture, Path) else self.picture()
        return picture if longest_side is None else shrink(picture, longest_side)

    def photo(self, longest_side: int | None = None) -> Photo:
        """The picture as a daylight photo, for whoever darkens and enhances photos."""
        return Photo(name=self.name, site=self.record, normal=partial(self.read, longest_side))


@dataclass(frozen=True)
class DrivingSet:
    """Queries, the references among which they are sought, and which reference is each query's partner.

    queries, references: by record, then time. truth: index of each query's reference. consecutive: whether frames
    whose index differs by 1 follow each other in a drive, or are scenes of their own. unmatched: a sentence for each
    picture that was left out, or for each folder of them. notes: what the protocol of an experiment should say.
    rectified: whether a point lies on the same row in both pictures of a pair.
    """

    name: str
    queries: list[Frame]
    references: list[Frame]
    truth: list[int]
    consecutive: bool
    unmatched: list[str]
    notes: list[str]
    rectified: bool = False

    def __len__(self) -> int:
        return len(self.queries)

    @property
    def counts(self) -> dict[str, int]:
        """Record -> number of queries, in the order of the queries."""
        return dict(Counter(frame.record for frame in self.queries))

    def every(self, step: int) -> "DrivingSet":
        """Every `step`-th moment of each record, its index counted in these steps.

        Raises: UserError if step is below 1 or leaves nothing.
        """
        if step < 1:
            raise UserError(f"the step between frames must be 1 or more, got {step}")
        places = [k for k, frame in enumerate(self.queries) if frame.index % step == 0]
        if not places:
            raise UserError(f"{self.name}: no pair is left at a step of {step}; take a smaller one")
        kept = {k: place for place, k in enumerate(sorted({self.truth[k] for k in places}))}

        def stepped(frame: Frame) -> Frame:
            return replace(frame, index=frame.index // step)

        return replace(
            self,
            queries=[stepped(self.queries[k]) for k in places],
            references=[stepped(self.references[k]) for k in kept],
            truth=[kept[self.truth[k]] for k in places],
            notes=[*self.notes, f"one moment in {step} of each record"] if step > 1 else self.notes,
        )

    def without(self, problems: Mapping[int, str]) -> "DrivingSet":
        """Without these references, number -> why, and without the queries whose partners they are.

        Raises: UserError if nothing is left.
        """
        kept = {k: place for place, k in enumerate(k for k in range(len(self.references)) if k not in problems)}
        places = [k for k, truth in enumerate(self.truth) if truth in kept]
        if not places:
            raise UserError(f"{self.name}: no pair is left; {next(iter(problems.values()))}")
        return replace(
            self,
            queries=[self.queries[k] for k in places],
            references=[self.references[k] for k in kept],
            truth=[kept[self.truth[k]] for k in places],
            unmatched=[*self.unmatched, *(f"{problem}; its pair is left out" for problem in problems.values())],
        )


def frames_apart(a: Frame, b: Frame) -> float:
    """How many moments lie between two frames of one record, 0 for partners; infinity in different records."""
    return abs(a.index - b.index) if a.record == b.record else math.inf


def metres_apart(a: Frame, b: Frame) -> float | None:
    """Distance of two frames' positions; None where one is unknown, infinity where their worlds differ."""
    if a.position_m is None or b.position_m is None:
        return None
    return math.dist(a.position_m, b.position_m) if a.world == b.world else math.inf
