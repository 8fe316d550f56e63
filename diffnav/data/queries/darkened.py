"""Queries that are asked by day and in the dark: one daylight picture, and the same darkened as Eq. 9 says."""

from dataclasses import dataclass, field, fields, replace
from fractions import Fraction
from typing import NamedTuple

from torch import Tensor

from diffnav.darkness import Darkening, DarknessModel, darken
from diffnav.data.pairs import photo_seed
from diffnav.data.queries.query import Query
from diffnav.errors import UserError


class BothLights(NamedTuple):
    """day, dark: (3, H, W) in [0, 1]. record: how `dark` was made of `day`, which it holds as its daylight image."""

    day: Tensor
    dark: Tensor
    record: Darkening


@dataclass(frozen=True, kw_only=True)
class DarkenedQuery(Query):
    """A query with a daylight and a dark picture.

    image: the daylight one. dark: which of them the camera delivered. darkness, seed: what the darkening is drawn from.
    """

    dark: bool = True
    darkness: DarknessModel = field(default_factory=DarknessModel)
    seed: int = 0

    def read(self) -> Tensor:
        """What the camera delivered: the dark picture where `dark`, else that by day. Raises: ImageError."""
        return self.read_both().dark if self.dark else self.read_day()

    def read_day(self) -> Tensor:
        """The daylight picture, (3, H, W) in [0, 1], whatever the camera delivered. Raises: ImageError."""
        return super().read()

    def read_both(self) -> BothLights:
        """Both pictures, whatever the camera delivered, and the darkening's record. Raises: ImageError."""
        day = self.read_day()
        # Only the picture knows its maximum, the M of Eq. 9; gamma follows from the seed alone.
        record = replace(self.darkness.draw(day.max().item(), self.seed), normal=day)
        return BothLights(day, darken(day, record), record)


def darkened(query: Query, darkness: DarknessModel | None = None, seed: int = 0, dark: bool = True) -> DarkenedQuery:
    """The same query with the same truth, darkened: for real photos, to be asked by day and in the dark.

    darkness: Eq. 9 as in the paper where none is given; drawn from `seed` and the query's name alone. dark: whether
    `read` gives the dark picture.
    """
    darkness = darkness or DarknessModel()
    seed = darkness_seed(seed, query.name)
    if isinstance(query, DarkenedQuery):
        return replace(query, dark=dark, darkness=darkness, seed=seed)
    facts = {known.name: getattr(query, known.name) for known in fields(Query)}
    return DarkenedQuery(**facts, dark=dark, darkness=darkness, seed=seed)


def darkness_seed(seed: int, name: str) -> int:
    """The seed of one query's darkness: the same whatever other queries there are."""
    return photo_seed(seed, f"darkness of {name}")


def is_dark(number: int, share: float) -> bool:
    """Whether query `number`, from 0, is a dark one, where `share` of them shall be: of the first n, floor(n share).

    Raises: UserError if the share is not from 0 to 1.
    """
    if not 0 <= share <= 1:
        raise UserError(f"query_set.dark must be a share from 0 to 1, got {share}")
    # As a fraction: the floor of 100 x .29 would be 28.
    part = Fraction(share).limit_denominator(1_000_000)
    return (number + 1) * part // 1 > number * part // 1
