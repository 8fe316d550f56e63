"""LightenNet: size, the network beside a slow transcription, and what dividing by an illumination means."""

import numpy as np
import pytest
import torch
from network_checks import check_batch, check_black_and_white, random_image

from diffnav.enhancers.lightennet import EPS, LightenNet


@pytest.fixture
def network() -> LightenNet:
    """Weights large enough that every layer matters, and an illumination that varies."""
    torch.manual_seed(1)
    network = LightenNet().eval()
    with torch.no_grad():
        for layer in network.layers:
            layer.weight.mul_(2.5)
    return network


def slow_convolution(x: np.ndarray, weight: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """Same size, borders replicated; an even kernel of k reaches k/2 - 1 to the left and top, k/2 to the others."""
    _, height, width = x.shape
    taps = weight.shape[2]
    before = (taps - 1) // 2
    result = np.tile(bias[:, None, None], (1, height, width)).astype(np.float64)
    for row in range(height):
        for column in range(width):
            for ky in range(taps):
                for kx in range(taps):
                    y = min(max(row + ky - before, 0), height - 1)
                    x_ = min(max(column + kx - before, 0), width - 1)
                    result[:, row, column] += weight[:, :, ky, kx] @ x[:, y, x_]
    return result


def test_it_has_28929_parameters() -> None:
    """PAPER 9: 10x10x32, 5x5x16, 7x7x8, 5x5x1."""
    network = LightenNet()
    assert network.parameter_count == 28_929
    assert [(layer.kernel_size[0], layer.out_channels) for layer in network.layers] == [
        (10, 32),
        (5, 16),
        (7, 8),
        (5, 1),
    ]


def test_the_network_is_four_convolutions_and_a_division(network: LightenNet) -> None:
    image = random_image(1, 3, 16, 19) * 0.3
    x = image[0].numpy().astype(np.float64)
    for number, layer in enumerate(network.layers):
        x = slow_convolution(x, layer.weight.detach().numpy(), layer.bias.detach().numpy())
        x = 1 / (1 + np.exp(-x)) if number == 3 else np.maximum(x, 0)
    expected = np.clip(image[0].numpy() / np.maximum(x, EPS), 0, 1)
    with torch.no_grad():
        np.testing.assert_allclose(network.illumination(image)[0].numpy(), x, atol=1e-5)
        np.testing.assert_allclose(network(image)[0].numpy(), expected, atol=1e-4)
    assert x.std() > 0.01, "an illumination that varies"


@pytest.mark.parametrize("size", [(16, 16), (17, 31), (33, 18)])
def test_odd_sizes_and_a_batch_one_by_one(network: LightenNet, size: tuple[int, int]) -> None:
    check_batch(network, size)


def test_a_picture_becomes_brighter_never_darker_and_a_flat_one_stays_flat(network: LightenNet) -> None:
    image = random_image(1, 3, 40, 30)
    flat = torch.full((1, 3, 40, 30), 0.1)
    with torch.no_grad():
        assert (network(image) >= image - 1e-6).all()
        result = network(flat)
    assert result.std() < 1e-5
    assert result.mean() > 0.1


def test_black_stays_black_and_white_white(network: LightenNet) -> None:
    check_black_and_white(network)


def test_the_gain_is_bounded(network: LightenNet) -> None:
    with torch.no_grad():
        network.layers[3].bias.fill_(-50)
        result = network(torch.full((1, 3, 16, 16), 0.001))
    torch.testing.assert_close(result, torch.full_like(result, 0.001 / EPS), atol=1e-5, rtol=0)


def test_tiles_leave_no_seams(network: LightenNet) -> None:
    image = random_image(1, 3, 97, 131) * 0.2
    with torch.no_grad():
        whole = network(image)
        network.tile_pixels = 64**2
        torch.testing.assert_close(network(image), whole, atol=1e-5, rtol=0)
        network.halo = 0
        assert (network(image) - whole).abs().max() > 1e-3, "the comparison would see a seam"
