"""Enhance-Net: a U-Net from (R, I) of a dark image to the illumination Ih of the enhanced one."""

from typing import Literal

import torch
from torch import Tensor, nn
from torch.nn.functional import interpolate

from diffnav.errors import UserError
from diffnav.retinex.decom import Padding

_ACTIVATIONS = {"sigmoid": torch.sigmoid, "relu": torch.relu, "none": lambda x: x}


def _block(inputs: int, width: int, padding: Padding) -> nn.Sequential:
    """Two 3x3 convolutions, a ReLU after each (D28)."""
    return nn.Sequential(
        nn.Conv2d(inputs, width, 3, padding=1, padding_mode=padding),
        nn.ReLU(),
        nn.Conv2d(width, width, 3, padding=1, padding_mode=padding),
        nn.ReLU(),
    )


class EnhanceNet(nn.Module):
    """Seven blocks, three 2x2 stride-2 convolutions down, three deconvolutions up; 987,265 parameters at width 64.

    The three deconvolution outputs, resized to full size, join block 7 before the last two convolutions.
    `outputs` is 1 for an illumination; the image-to-image rival takes 3. `detail` adds a second head of 3 channels
    beside the last convolution, ours and not the paper's; it begins as zero.
    """

    def __init__(
        self,
        width: int = 64,
        up_kernel: Literal[2, 4] = 4,
        activation: Literal["sigmoid", "relu", "none"] = "sigmoid",
        outputs: int = 1,
        padding: Padding = "replicate",
        detail: bool = False,
    ) -> None:
        super().__init__()
        if up_kernel not in (2, 4):
            raise UserError(f"network.up_kernel must be 2 or 4, got {up_kernel!r}")
        if activation not in _ACTIVATIONS:
            raise UserError(f"network.activation must be one of {', '.join(_ACTIVATIONS)}, got {activation!r}")
        self.activation = activation
        self.blocks = nn.ModuleList(
            _block(inputs, width, padding) for inputs in (4, width, width, width, 2 * width, 2 * width, 2 * width)
        )
        self.downs = nn.ModuleList(nn.Conv2d(width, width, 2, stride=2) for _ in range(3))
        self.ups = nn.ModuleList(
            nn.ConvTranspose2d(width, width, up_kernel, stride=2, padding=up_kernel // 2 - 1) for _ in range(3)
        )
        self.fuse = nn.Conv2d(4 * width, width, 3, padding=1, padding_mode=padding)
        self.last = nn.Conv2d(width, outputs, 3, padding=1, padding_mode=padding)
        self.detail = nn.Conv2d(width, 3, 3, padding=1, padding_mode=padding) if detail else None
        if self.detail is not None:
            nn.init.zeros_(self.detail.weight)
            nn.init.zeros_(self.detail.bias)  # type: ignore[arg-type]

    def forward(self, R: Tensor, I: Tensor) -> Tensor:
        """Ih (B, outputs, H, W) of R (B, 3, H, W) and I (B, 1, H, W); H and W divisible by 8.

        With `detail`, three channels more: the residual, of either sign.
        """
        x = torch.cat([R, I], 1)
        skips = []
        for block, down in zip(self.blocks[:3], self.downs, strict=True):
            x = block(x)
            skips.append(x)
            x = down(x)
        x = self.blocks[3](x)
        ups = []
        for up, block, skip in zip(self.ups, self.blocks[4:], reversed(skips), strict=True):
            ups.append(up(x))
            x = block(torch.cat([ups[-1], skip], 1))
        full = [interpolate(u, size=x.shape[2:], mode="nearest") for u in ups]
        x = torch.relu(self.fuse(torch.cat([x, *full], 1)))
        Ih = _ACTIVATIONS[self.activation](self.last(x).float())
        return Ih if self.detail is None else torch.cat([Ih, self.detail(x).float()], 1)
