"""What a localizer answers: a place with its uncertainty, or a reasoned "no fix"."""

from dataclasses import dataclass, field
from datetime import datetime
from typing import Literal

from torch import Tensor

Status = Literal["fix", "coasted", "no_fix"]


@dataclass(frozen=True)
class Fix:
    """The answer to one query.

    status: `fix`, located in a map; `coasted`, carried on from earlier fixes of its flight by their motion; `no_fix`.
    reasons: why there is no fix, each a short sentence; empty for a fix.
    latitude, longitude: degrees, of the picture's centre; heading_deg: compass heading of the picture's top, clockwise
    from north; ground_sample_distance_m: metres a pixel; sigma_m: standard deviation of the place, per axis; footprint:
    latitude, longitude of the picture's corners from the top left one clockwise: None (or empty) without a place.
    H_query_map: (3, 3) float64, query pixels to pixels of the whole map `map`; tile: in which it was found.
    inliers of matches. enhanced: whether the picture was brightened first; definition: Eq. 10 of the picture as taken.
    milliseconds: of each stage. time: when the picture was taken. flight: of pictures that follow each other, as of
    `Query`.
    """

    query: str
    status: Status
    reasons: tuple[str, ...] = ()
    latitude: float | None = None
    longitude: float | None = None
    heading_deg: float | None = None
    ground_sample_distance_m: float | None = None
    sigma_m: float | None = None
    footprint: tuple[tuple[float, float], ...] = ()
    H_query_map: Tensor | None = None
    map: str | None = None
    tile: str | None = None
    inliers: int = 0
    matches: int = 0
    enhanced: bool = False
    definition: float | None = None
    milliseconds: dict[str, float] = field(default_factory=dict)
    time: datetime | None = None
    flight: str = ""

    @property
    def place(self) -> tuple[float, float] | None:
        """Latitude and longitude, None without them."""
        return None if self.latitude is None or self.longitude is None else (self.latitude, self.longitude)
