"""The pairs of a source that can be used; the others are named, and the batch goes on."""

from collections.abc import Iterator, Sequence
from typing import NoReturn

from tqdm import tqdm

from diffnav.data.pair_source import PairSource
from diffnav.data.pairs import WholePair
from diffnav.data.photos import Photo
from diffnav.errors import UserError


def usable_pairs(source: PairSource, problems: list[str], bar: tqdm, cells: int) -> Iterator[tuple[Photo, WholePair]]:
    """Each photo with its pair; one that cannot be used adds a sentence to `problems` and moves `bar` on by `cells`."""
    for photo in source.photos:
        try:
            pair = source.read(photo)
        except UserError as error:
            problems.append(str(error))
            bar.update(cells)
            continue
        yield photo, pair


def refuse_none(count: int, problems: Sequence[str]) -> NoReturn:
    """Raise UserError: none of `count` photos can be used, and the first reason."""
    first = f": {problems[0]}" if problems else ""
    raise UserError(f"none of {count} photos can be used{first}")
