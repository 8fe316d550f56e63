"""Decom-Net: one image into reflectance R and illumination I (paper, section 1 of its networks)."""

from typing import Literal

import torch
from torch import Tensor, nn

from diffnav.errors import UserError

# What 3x3 convolutions see beyond the border (D16).
Padding = Literal["replicate", "zeros"]


class DecomNet(nn.Module):
    """Eight 3x3 convolutions of one size with jump connections; 226,244 parameters at width 64.

    Layer 0 sees R, G, B and, if `max_channel`, their maximum; layer 1 sees layer 0; layers 2-6 see the two layers
    before them, added or concatenated (`jump`); layer 7 gives R (3 channels) and I (1 channel) through a sigmoid.
    Stride 1 throughout: the printed "stride 2" contradicts the equal sizes stated beside it (D1).
    """

    def __init__(
        self,
        width: int = 64,
        jump: Literal["add", "concat"] = "add",
        max_channel: bool = True,
        padding: Padding = "replicate",
    ) -> None:
        super().__init__()
        if jump not in ("add", "concat"):
            raise UserError(f"network.jump must be add or concat, got {jump!r}")
        self.jump = jump
        self.max_channel = max_channel
        joined = 2 * width if jump == "concat" else width
        inputs = [4 if max_channel else 3, width, *[joined] * 5, width]
        outputs = [*[width] * 7, 4]
        self.layers = nn.ModuleList(
            nn.Conv2d(i, o, 3, padding=1, padding_mode=padding) for i, o in zip(inputs, outputs, strict=True)
        )

    def forward(self, image: Tensor) -> tuple[Tensor, Tensor]:
        """R (B, 3, H, W) and I (B, 1, H, W), both in (0, 1), of an image (B, 3, H, W) in [0, 1]."""
        if self.max_channel:
            image = torch.cat([image, image.amax(1, keepdim=True)], 1)
        before = torch.relu(self.layers[0](image))
        last = torch.relu(self.layers[1](before))
        for layer in self.layers[2:7]:
            joined = before + last if self.jump == "add" else torch.cat([before, last], 1)
            before, last = last, torch.relu(layer(joined))
        # float32 before the sigmoid: bf16 has no values between .996 and 1, and saturation must be seen.
        R_and_I = torch.sigmoid(self.layers[7](last).float())
        return R_and_I[:, :3], R_and_I[:, 3:]
