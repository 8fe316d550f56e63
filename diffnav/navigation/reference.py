"""All that a search knows of the ground: the features of many maps, and their tiles' places."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from diffnav.data.maps.geo_map import GeoMap, Window
from diffnav.errors import UserError
from diffnav.geometry.geodesy import haversine_m
from diffnav.geometry.georeference import ground_sample_distance_m
from diffnav.matching.matches import Features
from diffnav.navigation.ground import Ground, Place
from diffnav.navigation.map_features import MapFeatures


@dataclass(frozen=True)
class Region:
    """Features of a piece of ground: keypoints are pixels of `ground`, moved so that all are positive.

    size of the features: (h, w) of the square that they lie in.
    """

    features: Features
    ground: Ground


class Reference:
    """Maps with features, searched as one.

    maps: their features. tiles: (T, 2) of each tile, its map's number and its own. places: (T, 2) latitude, longitude
    of the tiles' middles; radii_m: (T,) from there to a corner; pixel_m: (T,) metres a pixel there.
    Raises: UserError without maps, or if two have one name.
    """

    def __init__(self, maps: Sequence[MapFeatures]) -> None:
        if not maps:
            raise UserError("map= gives no map: name an image with a georeference, a folder or a CSV of maps")
        name, count = Counter(features.map.name for features in maps).most_common(1)[0]
        if count > 1:
            raise UserError(f"{count} maps are called {name}: give their files different names")
        self.maps = tuple(maps)
        self.tiles = np.array([(m, k) for m, features in enumerate(maps) for k in range(len(features.windows))])
        measured = [_measure(features.map, features.windows) for features in maps]
        self.places, self.radii_m, self.pixel_m = (np.concatenate(column) for column in zip(*measured, strict=True))

    def __len__(self) -> int:
        return len(self.tiles)

    def name(self, tile: int) -> str:
        """`map/row-of-first-pixel,column-of-first-pixel` of a tile."""
        m, k = self.tiles[tile]
        top, left = self.maps[m].windows[k][:2]
        return f"{self.maps[m].map.name}/{top},{left}"

    def near(self, place: Place, radius_m: float) -> np.ndarray:
        """The numbers of the tiles that reach into a circle."""
        return np.flatnonzero(haversine_m(self.places, np.array(place)) <= self.radii_m + radius_m)

    def tile(self, tile: int) -> Features:
        """The features of one tile alone, in its own pixels."""
        m, k = self.tiles[tile]
        return self.maps[m].tile(k)

    def region(self, place: Place, radius_m: float, tile: int) -> Region:
        """The features of all maps in a square of twice `radius_m` around a place, in pixels as large as the tile's.

        Where maps overlap, the tile's own comes first, then the others in their order: a corner that two maps show
        would otherwise be its own rival in the ratio test.
        """
        own = int(self.tiles[tile][0])
        ground = Ground(_north_west(place, radius_m), float(self.pixel_m[tile]))
        side = max(1, round(2 * radius_m / ground.pixel_m))
        shown = np.unique(self.tiles[self.near(place, math.sqrt(2) * radius_m), 0])
        order = [own] + [int(m) for m in shown if m != own]
        parts: list[Features] = []
        before: list[GeoMap] = []
        for m in order:
            found = _in_square(self.maps[m], ground, side)
            if found is not None:
                features, latlon = found
                hidden = np.zeros(len(features), bool)
                for earlier in before:
                    hidden |= _shows(earlier, latlon)
                parts.append(_at(features, ~hidden))
                before.append(self.maps[m].map)
        return Region(_joined(parts, (side, side), self.tile(tile)), ground)


def _measure(geo_map: GeoMap, windows: Sequence[Window]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of each window, the middle's latitude and longitude, the distance to its farthest corner, metres a pixel."""
    box = np.array(windows, float)
    top, left, height, width = box.T
    middles = np.stack([left + (width - 1) / 2, top + (height - 1) / 2], 1)
    places = geo_map.georeference.latlon(middles)
    half = np.stack([width, height], 1) / 2
    corners = [geo_map.georeference.latlon(middles + half * sign) for sign in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    radii = np.max([haversine_m(places, corner) for corner in corners], axis=0)
    return places, radii, ground_sample_distance_m(geo_map.georeference, middles)


def _north_west(place: Place, radius_m: float) -> Place:
    latitude, longitude = Ground(place, 1.0).latlon(np.array([[-radius_m, -radius_m]]))[0]
    return float(latitude), float(longitude)


def _in_square(maps: MapFeatures, ground: Ground, side: int) -> tuple[Features, np.ndarray] | None:
    """A map's features in the ground's square of `side` pixels and their places (N, 2), None where it shows none."""
    edge = np.linspace(-0.5, side - 0.5, 9)
    border = np.concatenate([np.stack([edge, np.full(9, end)], 1) for end in (edge[0], edge[-1])])
    border = np.concatenate([border, border[:, ::-1]])
    pixels = maps.map.georeference.pixels(ground.latlon(border))
    low, high = np.floor(pixels.min(0)).astype(int), np.ceil(pixels.max(0)).astype(int) + 1
    height, width = maps.map.size
    left, top = max(low[0], 0), max(low[1], 0)
    right, bottom = min(high[0], width), min(high[1], height)
    if left >= right or top >= bottom:
        return None
    features = maps.within((top, left, bottom - top, right - left))
    latlon = maps.map.georeference.latlon(features.keypoints.double().numpy() + np.array([left, top]))
    points = ground.points(latlon)
    inside = np.all((points >= -0.5) & (points < side - 0.5), axis=1)
    moved = Features(torch.from_numpy(points).float(), features.descriptors, features.scores, (side, side))
    return _at(moved, inside), latlon[inside]


def _shows(geo_map: GeoMap, latlon: np.ndarray) -> np.ndarray:
    """Which places (N, 2) lie on a map, (N,) bool."""
    points = geo_map.georeference.pixels(latlon)
    height, width = geo_map.size
    return np.all((points >= -0.5) & (points < [width - 0.5, height - 0.5]), axis=1)


def _at(features: Features, keep: np.ndarray) -> Features:
    rows = torch.from_numpy(np.flatnonzero(keep))
    return Features(features.keypoints[rows], features.descriptors[rows], features.scores[rows], features.size)


def _joined(parts: Sequence[Features], size: tuple[int, int], like: Features) -> Features:
    """Features of several maps as one list, the strongest first."""
    if not parts:
        return Features(like.keypoints[:0], like.descriptors[:0], like.scores[:0], size)
    scores = torch.cat([part.scores for part in parts])
    order = scores.argsort(descending=True, stable=True)
    keypoints, descriptors = (
        torch.cat([getattr(part, n) for part in parts])[order] for n in ("keypoints", "descriptors")
    )
    return Features(keypoints.clamp(min=0), descriptors, scores[order], size)
