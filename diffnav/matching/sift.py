"""SIFT, as the paper's matching experiment uses it: 500 features, ratio test .75, mutual check."""

from typing import Any

import cv2
from torch import Tensor

from diffnav.matching.matches import Features, Matches
from diffnav.matching.nearest import match_nearest, nearest_settings
from diffnav.matching.opencv_features import detect_features


class Sift:
    """Difference-of-Gaussian keypoints with gradient histograms, matched to the nearest by Euclidean distance.

    features: how many descriptors at most, the strongest first (OpenCV keeps ties; they are cut). ratio: bound
    on nearest over second nearest distance, 1 for none. mutual: whether both must be each other's nearest.
    Source: Lowe 2004.
    """

    name = "sift"

    def __init__(self, features: int = 500, ratio: float = 0.75, mutual: bool = True) -> None:
        self.settings: dict[str, Any] = nearest_settings(features, ratio, mutual)

    def features(self, image: Tensor) -> Features:
        """Keypoints and descriptors (N, 128) of an image (3, H, W) in [0, 1]; N may be 0."""
        return sift_features(image, self.settings["features"])

    def match(self, a: Features, b: Features) -> Matches:
        """Matches that pass the ratio test and the mutual check, each position counted once."""
        return match_nearest(a, b, self.name, self.settings)


def sift_features(image: Tensor, most: int) -> Features:
    """At most `most` SIFT features of an image (3, H, W) in [0, 1], descriptors (N, 128) in 0 to 255.

    OpenCV doubles the image first, and by default lays pixel x of it at 2x, not at 2x + .5: every keypoint then lies
    .25 px too far to the left and top, which half a turn makes .5 px. The precise upscaling puts them right.
    """
    return detect_features(cv2.SIFT.create(nfeatures=most, enable_precise_upscale=True), image, most)
