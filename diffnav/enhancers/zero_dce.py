"""Zero-DCE: a small network draws a brightening curve for every pixel, trained without daylight pictures."""

import torch
from torch import Tensor, nn

from diffnav.retinex.tiles import TiledEnhancer

WIDTH = 32
CURVES = 8


class ZeroDce(TiledEnhancer):
    """Seven 3x3 convolutions (`concatenated_layers`) and tanh give eight curve maps; 79,416 parameters.

    The convolutions pad with zeros, as published.
    Source: Guo et al., Zero-Reference Deep Curve Estimation, CVPR 2020.
    """

    # Seven 3x3 convolutions reach 7 pixels.
    halo = 8

    def __init__(self) -> None:
        super().__init__()
        self.settings = {}
        inputs = [3, WIDTH, WIDTH, WIDTH, 2 * WIDTH, 2 * WIDTH, 2 * WIDTH]
        outputs = [WIDTH] * 6 + [3 * CURVES]
        convolutions = [nn.Conv2d(i, o, 3, padding=1) for i, o in zip(inputs, outputs, strict=True)]
        for convolution in convolutions:
            # As published: curves near 0, so that training starts from the picture as it is.
            nn.init.normal_(convolution.weight, 0.0, 0.02)
        self.layers = nn.ModuleList(convolutions)

    def curves(self, image: Tensor) -> Tensor:
        """The curve maps r_1 .. r_8 (B, 24, H, W) in [-1, 1] of an image (B, 3, H, W), three channels each."""
        # float32 before the tanh: bf16 has few values near the bounds.
        return torch.tanh(concatenated_layers(self.layers, image).float())

    def _whole(self, image: Tensor) -> Tensor:
        return apply_curves(image, self.curves(image))


def concatenated_layers(layers: nn.ModuleList, image: Tensor) -> Tensor:
    """What seven layers make of an image, ReLU between them; layers 5, 6, 7 see (3, 4), (2, 5), (1, 6)."""
    first = torch.relu(layers[0](image))
    second = torch.relu(layers[1](first))
    third = torch.relu(layers[2](second))
    fourth = torch.relu(layers[3](third))
    fifth = torch.relu(layers[4](torch.cat([third, fourth], 1)))
    sixth = torch.relu(layers[5](torch.cat([second, fifth], 1)))
    return layers[6](torch.cat([first, sixth], 1))


def apply_curves(image: Tensor, curves: Tensor) -> Tensor:
    """The image after x <- x + r (x^2 - x) for each r of `curves`: (B, 3, H, W) in [0, 1] -> the same.

    `curves`: (B, 3 n, H, W) in [-1, 1], n curves one after another. Black and white stay; negative r brightens: the
    published code's sign, opposite to the article's.
    """
    for r in curves.split(3, 1):
        image = image + r * (image.square() - image)
    return image
