"""LightenNet: four convolutions estimate an illumination, which divides the picture."""

import torch
from torch import Tensor, nn

from diffnav.retinex.tiles import TiledEnhancer

# Divisor's lower bound: one 8-bit step, so that no value is multiplied by more than 255.
EPS = 1 / 255


class LightenNet(TiledEnhancer):
    """Convolutions 10x10x32, 5x5x16, 7x7x8 and 5x5x1: 28,929 parameters, the count that is widely quoted.

    The sizes are unconfirmed: 10x10x32, 3x3x32, 3x3x32, 5x5x1 give the same count. Ours: sigmoid on the last layer,
    so that the illumination lies in (0, 1) and the picture only becomes brighter; borders replicated; even kernels
    keep the size by one more pixel at the right and bottom.
    Source: Li et al., LightenNet, Pattern Recognition Letters 104, 2018.
    """

    # The four kernels reach 5 + 2 + 3 + 2 pixels.
    halo = 16

    def __init__(self) -> None:
        super().__init__()
        self.settings = {}
        sizes = [(3, 32, 10), (32, 16, 5), (16, 8, 7), (8, 1, 5)]
        self.layers = nn.ModuleList(
            nn.Conv2d(inputs, outputs, kernel, padding="same", padding_mode="replicate")
            for inputs, outputs, kernel in sizes
        )

    def illumination(self, image: Tensor) -> Tensor:
        """L (B, 1, H, W) in (0, 1) of an image (B, 3, H, W) in [0, 1]."""
        x = image
        for layer in self.layers[:3]:
            x = torch.relu(layer(x))
        # float32 before the sigmoid: a coarse L would divide the picture into bands.
        return torch.sigmoid(self.layers[3](x).float())

    def _whole(self, image: Tensor) -> Tensor:
        return image / self.illumination(image).clamp(min=EPS)
