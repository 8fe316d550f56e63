"""What every source of maps gives: a georeferenced picture that is read window by window."""

from collections.abc import Callable
from dataclasses import dataclass

from torch import Tensor

from diffnav.geometry.georeference import Georeference

Window = tuple[int, int, int, int]


@dataclass(frozen=True)
class GeoMap:
    """One georeferenced picture.

    name: unique among the maps of a search. georeference: pixels to latitude and longitude, with the map's size (h, w).
    read: window (top, left, height, width) that lies inside the map -> (3, height, width) float32 RGB in [0, 1]; raises
    ImageError. fingerprint: hash of the picture's content, on which what is computed from it is stored.
    """

    name: str
    georeference: Georeference
    read: Callable[[Window], Tensor]
    fingerprint: str

    @property
    def size(self) -> tuple[int, int]:
        """(h, w) in pixels."""
        return self.georeference.size

    def picture(self) -> Tensor:
        """The whole map, (3, h, w). Raises: ImageError."""
        return self.read((0, 0, *self.size))
