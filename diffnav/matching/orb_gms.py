"""ORB with grid-based motion statistics, the paper's GMS: a match stays if its neighbours agree with it."""

from collections.abc import Sequence
from dataclasses import dataclass
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
        images = GmsImage.of(a), GmsImage.of(b)
        if len(a) == 0 or len(b) == 0:
            return self.supported(*images, torch.zeros(len(a), dtype=torch.long), torch.zeros(len(a)))
        nearest, bits, _ = two_nearest_hamming(a.descriptors, b.descriptors)
        return self.supported(*images, nearest, bits)

    def supported(self, a: "GmsImage", b: "GmsImage", nearest: Tensor, bits: Tensor) -> Matches:
        """Those that GMS keeps of the matches to each a's nearest b, (N,), at these Hamming distances, (N,)."""
        indices, distances = torch.zeros(0, 2, dtype=torch.long), torch.zeros(0)
        if len(a.points) > 0 and len(b.points) > 0:
            kept = from_contrib("matchGMS")(
                a.size,
                b.size,
                a.points,
                b.points,
                list(map(cv2.DMatch, range(len(a.points)), nearest.tolist(), bits.tolist())),
                withRotation=self.settings["rotation"],
                withScale=self.settings["scale"],
                thresholdFactor=self.settings["threshold_factor"],
            )
            rows = torch.tensor([match.queryIdx for match in kept], dtype=torch.long)
            indices, distances = torch.stack([rows, nearest[rows]], 1), bits[rows]
        indices, confidence = count_positions_once(a.features, b.features, indices, 1 - distances / _BITS)
        return matches_at(a.features, b.features, indices, confidence, self.name, self.settings)


@dataclass(frozen=True)
class GmsImage:
    """An image's features as GMS wants them. size: (width, height). points: the keypoints, OpenCV's."""

    features: Features
    size: tuple[int, int]
    points: Sequence[cv2.KeyPoint]

    @classmethod
    def of(cls, features: Features) -> "GmsImage":
        """Raises: ValueError if a keypoint lies outside of its image."""
        points = cv2.KeyPoint.convert(features.keypoints.tolist()) if len(features) else ()
        return cls(features, checked_size(features), points)


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
