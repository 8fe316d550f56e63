"""AKAZE: corners in a non-linear scale space with binary descriptors, ratio test and mutual check."""

from typing import Any

from torch import Tensor

from diffnav.errors import UserError
from diffnav.matching.matches import Features, Matches
from diffnav.matching.nearest import match_nearest, nearest_settings
from diffnav.matching.opencv_features import detect_features, from_contrib

# OpenCV corrupts memory on pictures one pixel wide; below 59 px none had a corner.
_LEAST_PX = 32


class Akaze:
    """Hessian corners of a picture smoothed along its edges, 486-bit descriptors, nearest by Hamming distance.

    features: how many at most, the strongest first. threshold: the least Hessian response, on the picture in [0, 1]:
    .001 is OpenCV's; a dark picture's corners are fainter, 1e-5 keeps them. ratio: bound on nearest over second
    nearest number of differing bits, 1 for none. mutual: whether both must be each other's nearest.
    Source: Alcantarilla et al. 2013.
    """

    name = "akaze"

    def __init__(self, features: int = 500, threshold: float = 0.001, ratio: float = 0.75, mutual: bool = True) -> None:
        settings = nearest_settings(features, ratio, mutual)
        if not isinstance(threshold, int | float) or not 0 < threshold < 1:
            raise UserError(f"matcher.threshold must be above 0 and below 1, got {threshold}")
        from_contrib("AKAZE")
        self.settings: dict[str, Any] = {**settings, "threshold": threshold}

    def features(self, image: Tensor) -> Features:
        """Keypoints and descriptors (N, 61) uint8 of an image (3, H, W) in [0, 1]; N may be 0."""
        most = self.settings["features"]
        detector = from_contrib("AKAZE").create(threshold=self.settings["threshold"], max_points=most)
        return detect_features(detector, image, most, least_px=_LEAST_PX)

    def match(self, a: Features, b: Features) -> Matches:
        """Matches that pass the ratio test and the mutual check, each position counted once."""
        return match_nearest(a, b, self.name, self.settings)
