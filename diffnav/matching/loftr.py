"""LoFTR: matches on a grid of 8 pixels, refined, without keypoints; both pictures are needed at once."""

import copy
from dataclasses import replace
from typing import Any

import kornia.feature
import torch
from kornia.color import rgb_to_grayscale
from kornia.feature.loftr.loftr import default_cfg
from torch import Tensor

from diffnav.errors import UserError
from diffnav.matching.learned import device_of, freeze, no_features, open_weights
from diffnav.matching.matches import Features, Matches
from diffnav.matching.nearest import count_positions_once, matches_at

SOURCE = "github.com/zju3dv/LoFTR (outdoor_ds.ckpt), or kornia's LoFTR('outdoor'), which keeps it under this name"


class Loftr:
    """Dense matches by attention between both pictures; as many as it finds, so no bound on features.

    min_confidence: a match is kept above it. weights: file (network under "state_dict") of the outdoor or the old
    indoor model, below the folder of published weights or with its whole path. device: where the network runs.

    Memory grows with the product of both pictures' areas: 600 x 400 takes 56 MB a table, 2400 x 1600 takes 14 GB.
    Source: Sun et al. 2021.
    """

    name = "loftr"

    def __init__(
        self, min_confidence: float = 0.2, weights: str = "loftr/loftr_outdoor.ckpt", device: str = "cpu"
    ) -> None:
        if not 0 <= min_confidence < 1:
            raise UserError(f"matcher.min_confidence must be in [0, 1), got {min_confidence}")
        found = open_weights(weights, SOURCE)
        config: dict[str, Any] = copy.deepcopy(default_cfg)
        config["match_coarse"]["thr"] = min_confidence
        network = kornia.feature.LoFTR(pretrained=None, config=config)
        self.network = freeze(network, found.part("state_dict"), found.path, device)
        self.settings: dict[str, Any] = {"min_confidence": min_confidence, **found.settings}

    def features(self, image: Tensor) -> Features:
        """No keypoints, but the image (3, H, W) in [0, 1] itself, for `match`."""
        return replace(no_features(0, (image.shape[1], image.shape[2])), image=image)

    @torch.no_grad()
    def match(self, a: Features, b: Features) -> Matches:
        """The matches between the images that the features hold. Raises: ValueError if they hold none."""
        found = self.network({"image0": self._input(a), "image1": self._input(b)})
        points_a, points_b = (to_pixel_centres(found[name]).float().cpu() for name in ("keypoints0", "keypoints1"))
        a, b = replace(a, keypoints=points_a), replace(b, keypoints=points_b)
        pairs = torch.arange(len(points_a))[:, None].expand(-1, 2)
        indices, confidence = count_positions_once(a, b, pairs, found["confidence"].float().cpu().clamp(0, 1))
        return matches_at(a, b, indices, confidence, self.name, self.settings)

    def _input(self, features: Features) -> Tensor:
        """The grey picture as the network takes it: (1, 1, H, W) in [0, 1]."""
        if features.image is None:
            raise ValueError("LoFTR needs features that hold their image: take those of Loftr.features")
        return rgb_to_grayscale(features.image[None].to(device_of(self.network)))


def to_pixel_centres(points: Tensor) -> Tensor:
    """LoFTR's points (M, 2), which count from the first pixel's corner, from its centre."""
    return points - 0.5
