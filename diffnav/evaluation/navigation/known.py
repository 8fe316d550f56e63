"""What a localizer is told of a query beforehand: a stated place, or what an evaluation knows of the truth."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.pairs import photo_seed
from diffnav.data.queries.query import Query
from diffnav.errors import UserError
from diffnav.geometry.geodesy import moved
from diffnav.navigation.ground import Place
from diffnav.navigation.prior import NOTHING, Prior


@dataclass(frozen=True)
class Known:
    """Which of a query's facts its prior may hold.

    radius_m: a circle of this radius that holds the truth, its middle drawn evenly from those that do; None: nothing is
    known of the place. A picture of a place that no map shows is told one that a map shows: what it is led to believe
    must not become a fix. place: latitude, longitude, the circle's middle for all queries instead. heading: the compass
    heading as logged, plus heading_offset_deg, the mounting's. scale: metres a pixel as recorded, or
    ground_sample_distance_m for all where it is given.
    Raises: UserError for a radius or ground sample distance of 0 or less, or a place without a radius.
    """

    radius_m: float | None = None
    place: Sequence[float] | None = None
    heading: bool = False
    heading_offset_deg: float = 0.0
    scale: bool = False
    ground_sample_distance_m: float | None = None

    def __post_init__(self) -> None:
        for name in ("radius_m", "ground_sample_distance_m"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise UserError(f"prior.{name} must be above 0 or null, got {value}")
        if self.place is not None:
            numbers = list(self.place) if isinstance(self.place, Sequence) else []
            if len(numbers) != 2 or not all(isinstance(one, int | float) for one in numbers) or abs(numbers[0]) > 90:
                raise UserError(f"prior.place must be [latitude,longitude] in degrees, got {self.place}")
            if self.radius_m is None:
                raise UserError("prior.place needs prior.radius_m, how far from it a picture may lie")

    def prior(self, query: Query, seed: int, maps: Sequence[GeoMap] = ()) -> Prior:
        """What is told of one query, drawn from the seed and its name alone. maps: that are searched."""
        place = self._place(query, seed, maps) if self.radius_m is not None else None
        heading_deg = query.heading_deg if self.heading else None
        if heading_deg is not None:
            heading_deg = (heading_deg + self.heading_offset_deg) % 360
        pixel_m = self.ground_sample_distance_m if self.ground_sample_distance_m else query.ground_sample_distance_m
        prior = Prior(place, self.radius_m if place else None, heading_deg, pixel_m if self.scale else None)
        return NOTHING if prior == Prior() else prior

    def _place(self, query: Query, seed: int, maps: Sequence[GeoMap]) -> Place | None:
        """The middle of the circle."""
        if self.place is not None:
            return float(self.place[0]), float(self.place[1])
        dice = np.random.default_rng(photo_seed(seed, f"prior of {query.name}"))
        if not query.on_map:
            return _shown_place(maps, dice) if maps else None
        if query.truth is None or self.radius_m is None:
            return None
        # The root makes places even over the disc.
        distance_m, angle = self.radius_m * math.sqrt(dice.random()), 2 * math.pi * dice.random()
        there = moved(query.truth, (distance_m * math.sin(angle), distance_m * math.cos(angle)))
        return float(there[0]), float(there[1])


def _shown_place(maps: Sequence[GeoMap], dice: np.random.Generator) -> Place:
    """Some place on one of the maps."""
    geo_map = maps[int(dice.integers(len(maps)))]
    height, width = geo_map.size
    latitude, longitude = geo_map.georeference.latlon(dice.random(2) * [width, height] - 0.5)
    return float(latitude), float(longitude)
