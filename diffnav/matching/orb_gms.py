"""ORB with grid-based motion statistics, the paper's GMS: a match stays if its neighbours agree with it."""

from typing import Any

import cv2
import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.matching.hamming import two_nearest_hamming
from diffnav.matching.matches import Features, Matches
from diffnav.matching.nearest import count_positions_once, matches_at, require_count
from diffnav.matching.opencv_features import from_contrib
from diffnav.matching.orb import orb_features

# Of ORB's descriptor.
_BITS = 256


class OrbGms:
    """ORB's features, each with its nearest by Hamming distance, kept where enough neighbours move alike.

    features: how many at most, the strongest first. rotation: try eight directions for the neighbourhood; without
    it a turned picture keeps hardly any match. scale: try five scales. threshold_factor: the support that a pair of
    cells needs, as a multiple of the square root of its features: the higher, the fewer matches.
    Confidence: the share of the descriptors' bits that agree. Source: Bian et al. 2017.
    """

    name = "orb_gms"

    def __init__(
        self, features: int = 500, rotation: bool = True, scale: bool = False, threshold_factor: float = 6.0
    ) -> None:
        require_count(features)
        for name, value in (("rotation", rotation), ("scale", scale)):
            if not isinstance(value, bool):
                raise UserError(f"matcher.{name} must be true or false, got {value}")
        if not isinstance(threshold_factor, int | float) or not 0 <= threshold_factor < float("inf"):
            raise UserError(f"matcher.threshold_factor must be 0 or more, got {threshold_factor}")
        from_contrib("matchGMS")
        self.settings: dict[str, Any] = {
            "features": features, "rotation": rotation, "scale": scale, "threshold_factor": threshold_factor,
        }  # fmt: skip

    def features(self, image: Tensor) -> Features:
        """Keypoints and descriptors (N, 32) uint8 of an image (3, H, W) in [0, 1]; N may be 0."""
        return orb_features(image, self.settings["features"])

    def match(self, a: Features, b: Features) -> Matches:
        """Matches that their neighbourhood supports, each position counted once.

        Raises: ValueError if a keypoint lies outside of its image.
        """
        indices, bits = self._supported(a, b)
        confidence = 1 - bits / _BITS
        indices, confidence = count_positions_once(a, b, indices, confidence)
        return matches_at(a, b, indices, confidence, self.name, self.settings)

    def _supported(self, a: Features, b: Features) -> tuple[Tensor, Tensor]:
        """Indices (M, 2) into a and b of the matches that GMS keeps, and their Hamming distances (M,)."""
        size_a, size_b = (checked_size(features) for features in (a, b))
        if len(a) == 0 or len(b) == 0:
            return torch.zeros(0, 2, dtype=torch.long), torch.zeros(0)
        nearest, bits, _ = two_nearest_hamming(a.descriptors, b.descriptors)
        pairs = [
            cv2.DMatch(i, j, distance)
            for i, (j, distance) in enumerate(zip(nearest.tolist(), bits.tolist(), strict=True))
        ]
        points_a, points_b = (cv2.KeyPoint.convert(features.keypoints.tolist()) for features in (a, b))
        kept = from_contrib("matchGMS")(
            size_a,
            size_b,
            points_a,
            points_b,
            pairs,
            withRotation=self.settings["rotation"],
            withScale=self.settings["scale"],
            thresholdFactor=self.settings["threshold_factor"],
        )
        rows = torch.tensor([match.queryIdx for match in kept], dtype=torch.long)
        return torch.stack([rows, nearest[rows]], 1), bits[rows]


def checked_size(features: Features) -> tuple[int, int]:
    """(width, height) of the image, as OpenCV wants it and does not check.

    Raises: ValueError if a keypoint lies outside: GMS would put it into the wrong cell of its grid, or none.
    """
    height, width = features.size
    outside = ((features.keypoints < 0) | (features.keypoints >= torch.tensor([width, height]))).any(1)
    if outside.any():
        x, y = features.keypoints[outside][0].tolist()
        raise ValueError(
            f"a keypoint at x {x:.1f}, y {y:.1f} lies outside of its image, {width} wide and {height} high: "
            "Features.size must be (height, width)"
        )
    return width, height
