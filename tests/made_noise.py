"""A picture that every test can make: noise with something to detect everywhere."""

import torch
from torch import Tensor
from torch.nn.functional import avg_pool2d


def noise(size: tuple[int, int], seed: int) -> Tensor:
    """Noise at four scales, (3, h, w) in [0, 1]: structure for a detector everywhere."""
    dice = torch.Generator().manual_seed(seed)
    layers = [
        avg_pool2d(torch.rand(3, size[0] + 2 * r, size[1] + 2 * r, generator=dice), 2 * r + 1, stride=1) * (2 * r + 1)
        for r in (1, 2, 4, 8)
    ]
    image = torch.stack(layers).sum(0)
    return (image - image.min()) / (image.max() - image.min())
