"""RootSIFT: SIFT whose descriptors are compared by the Hellinger kernel (Arandjelovic & Zisserman 2012)."""

from dataclasses import replace
from typing import Any

import torch
from torch import Tensor

from diffnav.matching.matches import Features, Matches
from diffnav.matching.nearest import match_nearest, nearest_settings
from diffnav.matching.sift import sift_features


class RootSift:
    """SIFT's keypoints, the square roots of its descriptors, matched to the nearest by Euclidean distance.

    features, ratio, mutual: as for `Sift`. Source: Arandjelovic & Zisserman 2012, section 2.
    """

    name = "rootsift"

    def __init__(self, features: int = 500, ratio: float = 0.75, mutual: bool = True) -> None:
        self.settings: dict[str, Any] = nearest_settings(features, ratio, mutual)

    def features(self, image: Tensor) -> Features:
        """Keypoints and descriptors (N, 128) of length 1 of an image (3, H, W) in [0, 1]; N may be 0."""
        found = sift_features(image, self.settings["features"])
        return replace(found, descriptors=root(found.descriptors))

    def match(self, a: Features, b: Features) -> Matches:
        """Matches that pass the ratio test and the mutual check, each position counted once."""
        return match_nearest(a, b, self.name, self.settings)


def root(descriptors: Tensor) -> Tensor:
    """The square root of each descriptor (N, D) >= 0 over its sum: of length 1, or 0 where it is 0.

    Squared Euclidean distance between two of them is 2 - 2 x the Hellinger kernel of the originals.
    """
    sums = descriptors.sum(1, keepdim=True)
    return (descriptors / sums.clamp(min=torch.finfo(descriptors.dtype).tiny)).sqrt()
