"""SURF, which no wheel of OpenCV holds, by our own hand: 500 features, ratio test .75, mutual check."""

from typing import Any

import cv2
import numpy as np
import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.images import to_uint8
from diffnav.matching.matches import Features, Matches
from diffnav.matching.nearest import match_nearest, nearest_settings
from diffnav.matching.surf_blobs import find_blobs
from diffnav.matching.surf_descriptors import describe, orientations
from diffnav.matching.surf_integral import integral_image


class Surf:
    """Blobs by box filters with sums of Haar wavelet responses, matched to the nearest by Euclidean distance.

    features: how many at most, the strongest first. threshold: the least determinant of the Hessian, of the picture
    in [0, 1]; 0 takes every blob, so that dark pictures have their 500 too. octaves: how many are searched. extended:
    128 numbers a descriptor, not 64. upright: descriptors are not turned (U-SURF). ratio: bound on nearest over
    second nearest distance, 1 for none. mutual: whether both must be each other's nearest.
    Source: Bay et al. 2008.
    """

    name = "surf"

    def __init__(
        self,
        features: int = 500,
        threshold: float = 0.0,
        octaves: int = 4,
        extended: bool = False,
        upright: bool = False,
        ratio: float = 0.75,
        mutual: bool = True,
    ) -> None:
        settings = nearest_settings(features, ratio, mutual)
        if not isinstance(threshold, int | float) or not 0 <= threshold < 1:
            raise UserError(f"matcher.threshold must be 0 or more and below 1, got {threshold}")
        if not isinstance(octaves, int) or not 1 <= octaves <= 8:
            raise UserError(f"matcher.octaves must be a whole number from 1 to 8, got {octaves}")
        for switch, value in (("extended", extended), ("upright", upright)):
            if not isinstance(value, bool):
                raise UserError(f"matcher.{switch} must be true or false, got {value}")
        own = {"threshold": threshold, "octaves": octaves, "extended": extended, "upright": upright}
        self.settings: dict[str, Any] = {**settings, **own}

    def features(self, image: Tensor) -> Features:
        """Keypoints and descriptors (N, 64 or 128) of length 1 of an image (3, H, W) in [0, 1]; N may be 0."""
        sums = integral_image(cv2.cvtColor(to_uint8(image), cv2.COLOR_RGB2GRAY))
        blobs = find_blobs(sums, self.settings["features"], self.settings["octaves"], self.settings["threshold"])
        directions = np.zeros(len(blobs.x)) if self.settings["upright"] else orientations(sums, blobs)
        descriptors = describe(sums, blobs, directions, self.settings["extended"])
        columns = (np.stack([blobs.x, blobs.y], 1), descriptors, blobs.response)
        keypoints, table, scores = (torch.from_numpy(column.astype(np.float32)) for column in columns)
        return Features(keypoints, table, scores, (image.shape[1], image.shape[2]))

    def match(self, a: Features, b: Features) -> Matches:
        """Matches that pass the ratio test and the mutual check, each position counted once."""
        return match_nearest(a, b, self.name, self.settings)
