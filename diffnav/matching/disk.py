"""DISK: keypoints and 128-D descriptors of a U-Net trained by policy gradient, mutual nearest neighbours."""

from typing import Any

import kornia.feature
import torch
from torch import Tensor

from diffnav.matching.cosine import match_by_cosine, require_cosine
from diffnav.matching.learned import device_of, freeze, no_features, open_weights, strongest
from diffnav.matching.matches import Features, Matches
from diffnav.matching.nearest import require_count

SOURCE = "github.com/cvlab-epfl/disk, or kornia's DISK.from_pretrained('depth')"
_WIDTH = 128
# Four halvings leave one pixel of such a picture, whose instance norm is not defined.
_BLOCK = 16


class Disk:
    """Keypoints and descriptors of DISK, matched to each other's nearest by the cosine of their descriptors.

    features: how many at most, the strongest first. min_cosine: bound on the cosine of matched descriptors, -1 for
    none, as its authors match. weights: the authors' file (network under "extractor"), below the folder of published
    weights or with its whole path. device: where the network runs; features come back on the CPU.
    Source: Tyszkiewicz et al. 2020.
    """

    name = "disk"

    def __init__(
        self,
        features: int = 500,
        min_cosine: float = -1.0,
        weights: str = "disk/depth-save.pth",
        device: str = "cpu",
    ) -> None:
        require_count(features)
        require_cosine(min_cosine)
        found = open_weights(weights, SOURCE)
        self.network = freeze(kornia.feature.DISK(), found.part("extractor"), found.path, device)
        self.settings: dict[str, Any] = {"features": features, "min_cosine": min_cosine, **found.settings}

    @torch.no_grad()
    def features(self, image: Tensor) -> Features:
        """Keypoints and descriptors (N, 128) of length 1 of an image (3, H, W) in [0, 1]; none up to 16 x 16."""
        size = (image.shape[1], image.shape[2])
        if max(size) <= _BLOCK:
            return no_features(_WIDTH, size)
        most = self.settings["features"]
        found = self.network(image[None].to(device_of(self.network)), n=most, pad_if_not_divisible=True)[0]
        return strongest(found.keypoints, found.descriptors, found.detection_scores, most, size)

    def match(self, a: Features, b: Features) -> Matches:
        """Matches that are mutual and similar enough, each position counted once."""
        return match_by_cosine(a, b, self.settings["min_cosine"], self.name, self.settings)
