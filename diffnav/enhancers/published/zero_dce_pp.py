"""Zero-DCE++ with its authors' weights: one curve map, found on a small picture, applied eight times."""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn.functional import interpolate

from diffnav.enhancers.zero_dce import CURVES, WIDTH, apply_curves, concatenated_layers
from diffnav.pretrained import file_sha256, filling_from, load_weights, pretrained_path

SHRINK = 12


def _separable(inputs: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(nn.Conv2d(inputs, inputs, 3, padding=1, groups=inputs), nn.Conv2d(inputs, outputs, 1))


class ReusedCurve(nn.Module):
    """Zero-DCE's layers as separable convolutions, three outputs, on the picture at 1/12; SGZ has the same.

    The curve is enlarged to the picture's size, where the published code crops the picture to multiples of 12.
    relative, source: of the weights file. Source: Li et al., TPAMI 2021.
    """

    def __init__(self, relative: str, source: str, folder: str | None) -> None:
        super().__init__()
        path = pretrained_path(relative, source, folder)
        self.sha256 = file_sha256(path)
        published = load_weights(path)
        inputs, outputs = [3, *[WIDTH] * 3, *[2 * WIDTH] * 3], [WIDTH] * 6 + [3]
        self.layers = nn.ModuleList(_separable(i, o) for i, o in zip(inputs, outputs, strict=True))
        # e_conv1.depth_conv.weight is our 0.0.weight, e_conv7.point_conv.bias our 6.1.bias.
        order = {"depth_conv": 0, "point_conv": 1}
        with filling_from(path):
            parts = {tuple(name.split(".")): tensor for name, tensor in published.items()}
            self.layers.load_state_dict({f"{int(c[6]) - 1}.{order[k]}.{w}": t for (c, k, w), t in parts.items()})
        self.requires_grad_(False).eval()

    def forward(self, image: Tensor, record: Sequence[Any] | None = None) -> Tensor:  # noqa: ARG002
        """The enhanced image: (B, 3, H, W) in [0, 1] -> the same."""
        height, width = image.shape[2:]
        small = interpolate(image, (max(height // SHRINK, 1), max(width // SHRINK, 1)), mode="bilinear")
        r = torch.tanh(concatenated_layers(self.layers, small))
        r = interpolate(r, (height, width), mode="bilinear", align_corners=True)
        return apply_curves(image, r.repeat(1, CURVES, 1, 1)).clamp(0, 1)


class PublishedZeroDcePp(ReusedCurve):
    """Zero-DCE++. folder: of published weights, None for the usual one. Raises: UserError if it does not fit."""

    def __init__(self, folder: str | None = None) -> None:
        source = "github.com/Li-Chongyi/Zero-DCE_extension, Zero-DCE++/snapshots_Zero_DCE++/Epoch99.pth"
        super().__init__("zero-dce++/Epoch99.pth", source, folder)
