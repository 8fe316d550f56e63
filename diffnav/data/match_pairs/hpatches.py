"""Darkened images of a sequence against its first one in daylight, with the published homographies."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import torch

from diffnav.data.hpatches import first_image, first_to_image
from diffnav.data.match_pairs.match_pair import MatchPair
from diffnav.data.pair_source import PairSource
from diffnav.data.photos import Photo
from diffnav.errors import UserError
from diffnav.images import read_image


@dataclass(frozen=True)
class HpatchesPairs:
    """Image 1 of each sequence is the reference; the others are darkened by Eq. 9 and enhanced.

    Raises: UserError if the source resizes pictures, for the homographies are those of the files.
    """

    kind: ClassVar[str] = "hpatches"
    source: PairSource

    def __post_init__(self) -> None:
        if self.source.size is not None:
            raise UserError("pairs=hpatches keeps the sizes that its homographies are made for; set data.size=null")

    @property
    def photos(self) -> Sequence[Photo]:
        return self.source.photos

    def read(self, photo: Photo) -> MatchPair:
        """The query and reference of one photo. Raises: UserError if it cannot be used."""
        if not isinstance(photo.normal, Path):
            raise UserError(f"{photo.name}: not a file of a sequence; pairs=hpatches needs data=hpatches")
        H_query_reference = torch.linalg.inv(first_to_image(photo.normal))
        reference = read_image(first_image(photo.normal))
        return MatchPair(self.source.read(photo), reference, H_query_reference)
