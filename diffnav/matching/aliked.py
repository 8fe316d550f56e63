"""ALIKED: keypoints and 128-D descriptors from deformable convolutions, mutual nearest neighbours."""

from typing import Any

import kornia.feature
import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.matching.cosine import match_by_cosine, require_cosine
from diffnav.matching.learned import device_of, freeze, open_weights, strongest
from diffnav.matching.matches import Features, Matches
from diffnav.matching.nearest import require_count

# Model -> the name of its row. n16rot was trained on rotated pictures.
MODELS = {
    "aliked-t16": "aliked_t16", "aliked-n16": "aliked", "aliked-n16rot": "aliked_rot", "aliked-n32": "aliked_n32",
}  # fmt: skip


class Aliked:
    """Keypoints and descriptors of ALIKED, matched to each other's nearest by the cosine of their descriptors.

    features: how many at most, the strongest first. min_cosine: bound on the cosine of matched descriptors, -1 for
    none. model: aliked-n16, aliked-n16rot, aliked-t16 or aliked-n32. weights: file, below the folder of published
    weights or with its whole path; None: aliked/MODEL.pth. device: where the network runs; features come back on
    the CPU.

    No detection threshold: with the published one (.2) the number of keypoints falls with darkness. No bound on the
    cosine: .75 keeps a fifth fewer correct matches in darkened pictures turned by 15 degrees, nearly none at 30.
    Source: Zhao et al. 2023.
    """

    def __init__(
        self,
        features: int = 500,
        min_cosine: float = -1.0,
        model: str = "aliked-n16",
        weights: str | None = None,
        device: str = "cpu",
    ) -> None:
        require_count(features)
        require_cosine(min_cosine)
        if model not in MODELS:
            raise UserError(f"matcher.model must be {', '.join(MODELS)}; got {model!r}")
        found = open_weights(weights or f"aliked/{model}.pth", aliked_source(model))
        network = kornia.feature.ALIKED(model, features, detection_threshold=0.0)
        self.network = freeze(network, found.content, found.path, device, may_lack=("dkd.hw_grid",))
        self.name = MODELS[model]
        self.settings: dict[str, Any] = {
            "features": features, "min_cosine": min_cosine, "model": model, **found.settings,
        }  # fmt: skip

    @torch.no_grad()
    def features(self, image: Tensor) -> Features:
        """Keypoints and descriptors (N, 128) of length 1 of an image (3, H, W) in [0, 1]; N may be 0."""
        found = self.network(image[None].to(device_of(self.network)))[0]
        size = (image.shape[1], image.shape[2])
        # Ordered anew: the network chooses by whole pixels, and reports the score at the refined position.
        return strongest(found.keypoints, found.descriptors, found.keypoint_scores, self.settings["features"], size)

    def match(self, a: Features, b: Features) -> Matches:
        """Matches that are mutual and similar enough, each position counted once."""
        return match_by_cosine(a, b, self.settings["min_cosine"], self.name, self.settings)


def aliked_source(model: str) -> str:
    """Where a model's weights come from."""
    return f"github.com/Shiaoming/ALIKED, models/, or kornia's ALIKED.from_pretrained('{model}')"
