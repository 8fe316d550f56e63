"""Zero-DCE: size, the network and its curves beside a slow transcription, and what curves can and cannot do."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from network_checks import check_batch, check_black_and_white, random_image

from diffnav.enhancers.zero_dce import ZeroDce, apply_curves


@pytest.fixture
def network() -> ZeroDce:
    """Weights large enough that every layer matters."""
    torch.manual_seed(3)
    network = ZeroDce().eval()
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.copy_(torch.randn_like(parameter) * (0.1 if parameter.ndim == 1 else 0.08))
    return network


def slow_convolution(x: np.ndarray, weight: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """3x3, zeros outside: loops over pixels and taps."""
    _, height, width = x.shape
    result = np.tile(bias[:, None, None], (1, height, width)).astype(np.float64)
    for row in range(height):
        for column in range(width):
            for dy in (-1, 0, 1):
                for dx in (-1, 0, 1):
                    if 0 <= row + dy < height and 0 <= column + dx < width:
                        result[:, row, column] += weight[:, :, dy + 1, dx + 1] @ x[:, row + dy, column + dx]
    return result


def test_it_has_79416_parameters() -> None:
    """PAPER 9."""
    assert ZeroDce().parameter_count == 79_416


def test_the_network_is_the_articles(network: ZeroDce) -> None:
    """Layer 5 sees (3, 4), 6 sees (2, 5), 7 sees (1, 6); tanh; eight times x <- x + r (x^2 - x)."""
    image = random_image(1, 3, 5, 7)
    weights = [(layer.weight.detach().numpy(), layer.bias.detach().numpy()) for layer in network.layers]
    x = {0: image[0].numpy().astype(np.float64)}
    sees = {1: (0,), 2: (1,), 3: (2,), 4: (3,), 5: (3, 4), 6: (2, 5), 7: (1, 6)}
    for layer, inputs in sees.items():
        out = slow_convolution(np.concatenate([x[one] for one in inputs]), *weights[layer - 1])
        x[layer] = np.tanh(out) if layer == 7 else np.maximum(out, 0)
    expected = x[0]
    for turn in range(8):
        r = x[7][3 * turn : 3 * turn + 3]
        expected = expected + r * (expected**2 - expected)
    with torch.no_grad():
        np.testing.assert_allclose(network.curves(image)[0].numpy(), x[7], atol=1e-5)
        np.testing.assert_allclose(network(image)[0].numpy(), expected, atol=1e-5)
    assert x[7].std() > 0.1, "curves that differ from place to place"


def test_a_curve_by_hand() -> None:
    """r = -1 twice turns x into 1 - (1 - x)^4; r = 1 once squares."""
    image = torch.full((1, 3, 1, 1), 0.2)
    brighter = apply_curves(image, torch.full((1, 6, 1, 1), -1.0))
    assert brighter[0, :, 0, 0].tolist() == pytest.approx([1 - 0.8**4] * 3)
    assert apply_curves(image, torch.ones(1, 3, 1, 1))[0, 0, 0, 0].item() == pytest.approx(0.04)


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=8, max_size=8))
def test_curves_keep_range_order_black_and_white(r: list[float]) -> None:
    ramp = torch.linspace(0, 1, 256, dtype=torch.float64).expand(1, 3, 1, 256)
    curves = torch.tensor(r, dtype=torch.float64).repeat_interleave(3).reshape(1, 24, 1, 1)
    result = apply_curves(ramp, curves)[0, 0, 0]
    assert (result.diff() >= -1e-12).all()
    assert (result[0].item(), result[-1].item()) == (0, 1)


@pytest.mark.parametrize("size", [(16, 16), (17, 31), (33, 18)])
def test_odd_sizes_and_a_batch_one_by_one(network: ZeroDce, size: tuple[int, int]) -> None:
    check_batch(network, size)


def test_black_stays_black_and_white_white(network: ZeroDce) -> None:
    check_black_and_white(network)


def test_tiles_leave_no_seams(network: ZeroDce) -> None:
    image = random_image(1, 3, 97, 131)
    with torch.no_grad():
        whole = network(image)
        network.tile_pixels = 56**2
        torch.testing.assert_close(network(image), whole, atol=1e-5, rtol=0)
        network.halo = 0
        assert (network(image) - whole).abs().max() > 1e-3, "the comparison would see a seam"
