"""Whole dark and daylight pairs of a list of photos, read one at a time."""

from collections.abc import Sequence
from dataclasses import dataclass

from diffnav.darkness import DarknessModel
from diffnav.data.pairs import WholePair, WholePairs
from diffnav.data.photos import Photo
from diffnav.data.store import PhotoStore
from diffnav.errors import UserError
from diffnav.retinex.enhancer import SMALLEST_PX


@dataclass(frozen=True)
class PairSource:
    """Which pairs are measured: photos, how they are darkened, and the size (h, w) they are resized to, if any."""

    photos: Sequence[Photo]
    darkness: DarknessModel
    seed: int = 0
    size: tuple[int, int] | None = None

    def read(self, photo: Photo) -> WholePair:
        """The pair of one photo. Raises: UserError if it cannot be read or has no daylight picture."""
        if photo.normal is None:
            raise UserError(f"{photo.low}: has no daylight picture to compare with")
        # One photo at a time: a test set may be larger than the memory.
        return WholePairs(PhotoStore([photo], self.size, SMALLEST_PX), self.darkness, self.seed)[0]
