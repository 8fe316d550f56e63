"""A small map's tiles and a matcher that counts, for the tests of the feature store."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from torch import Tensor

from diffnav.matching.matches import Features, Matches
from diffnav.matching.sift import Sift
from diffnav.navigation.map_features import MapFeatures
from diffnav.navigation.tiles import tile_windows

WINDOWS = tile_windows((140, 200), (100, 100), 0.2)


class Counting:
    """SIFT that counts the pictures it saw and does something before each."""

    name = "counting"

    def __init__(self, features: int = 40, before: Callable[[int], None] = lambda _: None) -> None:
        self.settings: Mapping[str, Any] = {"features": features}
        self.sift, self.before, self.seen = Sift(features), before, 0

    def features(self, image: Tensor) -> Features:
        self.before(self.seen)
        self.seen += 1
        return self.sift.features(image)

    def match(self, a: Features, b: Features) -> Matches:
        return self.sift.match(a, b)


class StoppedError(Exception):
    """What ends a search half-way."""


def stop_at(number: int) -> Callable[[int], None]:
    def stop(seen: int) -> None:
        if seen == number:
            raise StoppedError

    return stop


def same(a: MapFeatures, b: MapFeatures) -> bool:
    arrays = ("offsets", "keypoints", "descriptors", "scores")
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in arrays)
