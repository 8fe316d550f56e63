"""Maps made of noise, and of hand-placed features, on ground measured in metres from one origin."""

import math
from collections.abc import Sequence

import numpy as np
from torch import Tensor

from diffnav.data.maps.geo_map import GeoMap, Window
from diffnav.geometry.georeference import AffineGeoreference, LocalMetres
from diffnav.navigation.map_features import MapFeatures

ORIGIN = (47.0, 8.0)
DEGREE_M = math.radians(1) * 6_371_008.8
Place = tuple[float, float]


def metres_from(origin: Place, place: Sequence[float]) -> Place:
    """East and north of a place a kilometre away at most: a plane in which a degree is as long as in between."""
    middle = math.radians((origin[0] + place[0]) / 2)
    turn = (place[1] - origin[1] + 180) % 360 - 180
    return turn * DEGREE_M * math.cos(middle), (place[0] - origin[0]) * DEGREE_M


def picture_map(
    picture: Tensor, name: str = "made", corner: Place = (0.0, 0.0), pixel_m: float = 0.5, origin: Place = ORIGIN
) -> GeoMap:
    """A north-up map whose first pixel's centre lies at `corner`, metres east and north of the origin."""

    def read(window: Window) -> Tensor:
        top, left, height, width = window
        return picture[:, top : top + height, left : left + width]

    return GeoMap(name, _georeference((picture.shape[1], picture.shape[2]), corner, pixel_m, origin), read, name)


def placed_features(
    points: Sequence[Place],
    name: str = "made",
    size: tuple[int, int] = (100, 100),
    corner: Place = (0.0, 0.0),
    pixel_m: float = 0.5,
    origin: Place = ORIGIN,
    descriptors: np.ndarray | None = None,
    scores: Sequence[float] | None = None,
) -> MapFeatures:
    """A map of one tile with features at these pixels; without more their descriptors are 1, 2, 3, ..."""

    def read(window: Window) -> Tensor:
        raise AssertionError(f"{name} was read at {window}")

    geo_map = GeoMap(name, _georeference(size, corner, pixel_m, origin), read, name)
    count = len(points)
    if descriptors is None:
        descriptors = np.arange(1, count + 1, dtype=np.float32)[:, None]
    strengths = np.ones(count) if scores is None else np.array(scores)
    return MapFeatures(
        geo_map,
        ((0, 0, *size),),
        np.array([0, count]),
        np.array(points, np.float32).reshape(-1, 2),
        descriptors,
        strengths.astype(np.float32),
        False,
    )


def _georeference(size: tuple[int, int], corner: Place, pixel_m: float, origin: Place) -> AffineGeoreference:
    return AffineGeoreference(size, LocalMetres(origin), (pixel_m, 0.0, corner[0], 0.0, -pixel_m, corner[1]))
