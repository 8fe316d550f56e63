"""SIFT, as the paper's matching experiment uses it: 500 features, ratio test .75, mutual check."""

from typing import Any

import cv2
import numpy as np
import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.images import to_uint8
from diffnav.matching.matches import Features, Matches
from diffnav.matching.nearest import count_positions_once, nearest_neighbours


class Sift:
    """Difference-of-Gaussian keypoints with gradient histograms, matched to the nearest by Euclidean distance.

    features: how many descriptors at most, the strongest first (OpenCV keeps ties; they are cut here). ratio: bound
    on nearest over second nearest distance, 1 for none. mutual: whether both must be each other's nearest.
    Source: Lowe 2004.
    """

    name = "sift"

    def __init__(self, features: int = 500, ratio: float = 0.75, mutual: bool = True) -> None:
        if features < 1:
            raise UserError(f"matcher.features must be 1 or more, got {features}")
        if not 0 < ratio <= 1:
            raise UserError(f"matcher.ratio must be above 0 and at most 1, got {ratio}")
        self.settings: dict[str, Any] = {"features": features, "ratio": ratio, "mutual": mutual}

    def features(self, image: Tensor) -> Features:
        """Keypoints and descriptors (N, 128) of an image (3, H, W) in [0, 1]; N may be 0."""
        most = self.settings["features"]
        grey = cv2.cvtColor(to_uint8(image), cv2.COLOR_RGB2GRAY)
        found, descriptors = cv2.SIFT.create(nfeatures=most).detectAndCompute(grey, None)
        if descriptors is None:
            descriptors = np.zeros((0, 128), np.float32)
        rows = [(*keypoint.pt, keypoint.response) for keypoint in found]
        table = torch.tensor(rows, dtype=torch.float32).reshape(-1, 3)
        order = table[:, 2].argsort(descending=True, stable=True)[:most]
        size = (image.shape[1], image.shape[2])
        return Features(table[order, :2], torch.from_numpy(descriptors)[order], table[order, 2], size)

    def match(self, a: Features, b: Features) -> Matches:
        """Matches that pass the ratio test and the mutual check, each position counted once."""
        indices, confidence = nearest_neighbours(
            a.descriptors, b.descriptors, self.settings["ratio"], self.settings["mutual"]
        )
        indices, confidence = count_positions_once(a, b, indices, confidence)
        points_a, points_b = a.keypoints[indices[:, 0]], b.keypoints[indices[:, 1]]
        return Matches(points_a, points_b, confidence, self.name, self.settings)
