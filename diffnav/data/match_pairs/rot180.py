"""The paper's matching pairs: the enhanced picture turned by 180 degrees against the daylight one (PAPER 6)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from diffnav.data.match_pairs.match_pair import MatchPair, size_of
from diffnav.data.pair_source import PairSource
from diffnav.data.photos import Photo
from diffnav.geometry.homography import rotate_180, rotation_180


@dataclass(frozen=True)
class Rot180Pairs:
    """Each photo darkened, enhanced, then turned by 180 degrees for a change of heading; exact, nothing resampled."""

    kind: ClassVar[str] = "rot180"
    source: PairSource

    @property
    def photos(self) -> Sequence[Photo]:
        return self.source.photos

    def read(self, photo: Photo) -> MatchPair:
        """The query and reference of one photo. Raises: UserError if it cannot be used."""
        pair = self.source.read(photo)
        return MatchPair(pair, pair["normal"], rotation_180(size_of(pair["normal"])), view=rotate_180)
