import pytest
import torch
from torch.nn.functional import avg_pool2d


@pytest.fixture(scope="session")
def picture():
    """Noise at four scales, (3, 180, 260): structure for a detector everywhere."""
    dice = torch.Generator().manual_seed(3)
    layers = [
        avg_pool2d(torch.rand(3, 180 + 2 * r, 260 + 2 * r, generator=dice), 2 * r + 1, stride=1) * (2 * r + 1)
        for r in (1, 2, 4, 8)
    ]
    image = torch.stack(layers).sum(0)
    return (image - image.min()) / (image.max() - image.min())
