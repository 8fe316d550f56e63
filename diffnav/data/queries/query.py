"""What every source of queries gives: a camera picture, what is known of it, and the truth where there is one."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from torch import Tensor

from diffnav.images import read_image


@dataclass(frozen=True)
class Query:
    """One camera picture to be located.

    name: unique in its set. image: its file, or a function that makes it. truth: latitude, longitude in degrees of the
    place that shall be found, None where it is not known. on_map: False for a picture of a place that no map shows (it
    must not be located). heading_deg: compass heading of the picture's top, clockwise from north; height_m: above
    ground; ground_sample_distance_m: metres a pixel: each None where nobody knows. time: when it was taken.
    flight: pictures of one flight follow each other in the order of the set; empty: each stands alone.
    """

    name: str
    image: Path | Callable[[], Tensor]
    truth: tuple[float, float] | None = None
    on_map: bool = True
    heading_deg: float | None = None
    height_m: float | None = None
    ground_sample_distance_m: float | None = None
    time: datetime | None = None
    flight: str = ""

    def read(self) -> Tensor:
        """The picture, (3, H, W) in [0, 1]. Raises: ImageError."""
        return read_image(self.image) if isinstance(self.image, Path) else self.image()
