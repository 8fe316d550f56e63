"""SCI with its authors' weights: three tiny convolutions estimate an illumination, which divides the picture."""

from collections.abc import Sequence
from typing import Any, Literal

import torch
from torch import Tensor, nn

from diffnav.errors import UserError
from diffnav.pretrained import file_sha256, filling_from, load_weights, pretrained_path


def _conv() -> nn.Conv2d:
    return nn.Conv2d(3, 3, 3, padding=1)


class PublishedSci(nn.Module):
    """S / clamp(S + f(S), 1e-4, 1), f three 3x3 convolutions: (B, 3, H, W) in [0, 1] -> the same.

    variant: easy, medium or difficult, the darkness it was trained for. folder: of published weights, None for the
    usual one. Raises: UserError if it does not fit. Source: Ma et al., CVPR 2022.
    """

    def __init__(self, variant: Literal["easy", "medium", "difficult"] = "medium", folder: str | None = None) -> None:
        super().__init__()
        if variant not in ("easy", "medium", "difficult"):
            raise UserError(f"published_sci's variant must be easy, medium or difficult, got {variant!r}")
        path = pretrained_path(f"sci/{variant}.pt", f"github.com/vis-opt-group/SCI, weights/{variant}.pt", folder)
        self.sha256 = file_sha256(path)
        self.in_conv = nn.Sequential(_conv())
        self.conv = nn.Sequential(_conv(), nn.BatchNorm2d(3))
        self.out_conv = nn.Sequential(_conv())
        # The rest of the file: `calibrate`, which training alone needs, and `conv` again as a block.
        prefix, wanted = "enhance.", ("in_conv", "conv", "out_conv")
        with filling_from(path):
            tensors = load_weights(path).items()
            published = {name.removeprefix(prefix): t for name, t in tensors if name.startswith(prefix)}
            self.load_state_dict({name: t for name, t in published.items() if name.split(".")[0] in wanted})
        self.requires_grad_(False).eval()

    def forward(self, image: Tensor, record: Sequence[Any] | None = None) -> Tensor:  # noqa: ARG002
        """The enhanced image."""
        features = torch.relu(self.in_conv(image))
        features = features + torch.relu(self.conv(features))
        illumination = torch.sigmoid(self.out_conv(features)) + image
        return (image / illumination.clamp(1e-4, 1)).clamp(0, 1)
