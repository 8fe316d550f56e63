"""ALIKED's descriptors at given points, differentiable in the image."""

import kornia.feature
import torch
from torch import Tensor, nn

from diffnav.errors import UserError
from diffnav.matching.aliked import MODELS, aliked_source
from diffnav.matching.learned import freeze, open_weights


class AlikedDescriptor(nn.Module):
    """ALIKED, 128-D: image (B, 3, H, W), frames (B, K, 2, 3) -> (B, K, 128) of length 1.

    model: aliked-n16, aliked-n16rot, aliked-t16 or aliked-n32. weights: file, below the folder of published weights or
    with its whole path; None: aliked/MODEL.pth. Source: Zhao et al. 2023.
    """

    follows_turns = False

    def __init__(self, model: str = "aliked-n16", weights: str | None = None) -> None:
        super().__init__()
        if model not in MODELS:
            raise UserError(f"descriptor.model must be {', '.join(MODELS)}; got {model!r}")
        found = open_weights(weights or f"aliked/{model}.pth", aliked_source(model))
        self.network = freeze(kornia.feature.ALIKED(model), found.content, found.path, "cpu", may_lack=("dkd.hw_grid",))

    def train(self, mode: bool = True) -> "AlikedDescriptor":  # noqa: ARG002 - frozen: statistics never move
        return super().train(False)

    def forward(self, image: Tensor, frames: Tensor) -> Tensor:
        """The descriptors of the frames' positions."""
        features, _ = self.network.extract_dense_map(image)
        size = frames.new_tensor([image.shape[3] - 1, image.shape[2] - 1])
        positions = 2 * frames[..., 2] / size - 1
        descriptors, _ = self.network.desc_head(features, list(positions.to(features)))
        return torch.stack(descriptors)
