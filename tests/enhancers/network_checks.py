"""What the learned baselines must do, checked in each one's test."""

import torch
from torch import Tensor, nn


def random_image(*shape: int) -> Tensor:
    return torch.rand(*shape, generator=torch.Generator().manual_seed(0))


@torch.no_grad()
def check_batch(network: nn.Module, size: tuple[int, int]) -> None:
    """A batch of two pictures (h, w) gives what each gives alone, of the same shape."""
    image = random_image(2, 3, *size)
    result = network(image)
    assert result.shape == image.shape
    torch.testing.assert_close(result, torch.cat([network(one[None]) for one in image]), atol=1e-6, rtol=0)


@torch.no_grad()
def check_black_and_white(network: nn.Module) -> None:
    """Black stays black, and white white."""
    assert network(torch.zeros(1, 3, 20, 20)).abs().max() == 0
    assert (network(torch.ones(1, 3, 20, 20)) - 1).abs().max() < 1e-6
