"""ORB: FAST corners with steered binary descriptors, ratio test and mutual check."""

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from torch import Tensor

from diffnav.matching.matches import Features, Matches
from diffnav.matching.nearest import match_nearest, nearest_settings
from diffnav.matching.opencv_features import detect_features

_SCALE = 1.2
_LEVELS = 8
# No corner is sought closer to the picture's edge: the descriptor needs its surroundings (OpenCV's edgeThreshold).
_BORDER_PX = 31


class Orb:
    """Oriented FAST corners and rotated BRIEF, matched to the nearest by Hamming distance.

    features: how many at most, the strongest by Harris response first. ratio: bound on nearest over second nearest
    number of differing bits, 1 for none. mutual: whether both must be each other's nearest.
    Source: Rublee et al. 2011.
    """

    name = "orb"

    def __init__(self, features: int = 500, ratio: float = 0.75, mutual: bool = True) -> None:
        self.settings: dict[str, Any] = nearest_settings(features, ratio, mutual)

    def features(self, image: Tensor) -> Features:
        """Keypoints and descriptors (N, 32) uint8 of an image (3, H, W) in [0, 1]; N may be 0."""
        return orb_features(image, self.settings["features"])

    def match(self, a: Features, b: Features) -> Matches:
        """Matches that pass the ratio test and the mutual check, each position counted once."""
        return match_nearest(a, b, self.name, self.settings)


def orb_features(image: Tensor, most: int) -> Features:
    """At most `most` ORB features of an image (3, H, W) in [0, 1], descriptors (N, 32) uint8 of 8 bits each.

    FAST takes every corner however faint (threshold 0, as GMS's authors advise): a dark picture has features too.
    An image with less than 63 pixels to a side has none.
    """
    detector = cv2.ORB.create(
        nfeatures=most, scaleFactor=_SCALE, nlevels=_LEVELS, edgeThreshold=_BORDER_PX, fastThreshold=0
    )
    levels = [level_scales(level, (image.shape[1], image.shape[2])) for level in range(_LEVELS)]
    # OpenCV fails where a level of the pyramid would be empty.
    return detect_features(
        detector, image, most, lambda keypoint: centre_px(keypoint.pt, *levels[keypoint.octave]), 2 * _BORDER_PX + 1
    )


def level_scales(level: int, size: tuple[int, int]) -> tuple[float, float, float]:
    """(1.2^level, w / w', h / h'): nominal scale of a pyramid level and the real ones, for an image of `size` (h, w).

    In float32, as OpenCV computes the level's whole numbers of pixels w' and h': halves must fall to the same side.
    """
    nominal = np.float32(float(np.float32(_SCALE)) ** level)
    height, width = (side / max(1, round(float(np.float32(side) * (1 / nominal)))) for side in size)
    return float(nominal), width, height


def centre_px(point: Sequence[float], nominal: float, scale_x: float, scale_y: float) -> tuple[float, float]:
    """Where a point that OpenCV's ORB reports really lies: x, y in pixels.

    OpenCV reports a level's pixel i as i * nominal; its centre lies at (i + .5) * scale - .5. The difference grows
    with the level and along the picture, to 3 px in one of 600 x 400, and half a turn doubles it.
    """
    x, y = point
    return (x / nominal + 0.5) * scale_x - 0.5, (y / nominal + 0.5) * scale_y - 0.5
