"""Tiled inference: no seams, no tile too large, none too small."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from diffnav.retinex import tiles
from diffnav.retinex.enhancer import DirectEnhancer, Enhancer, RetinexEnhancer
from diffnav.retinex.tiles import HALO, apply_tiled

# A tile with a core of 40 pixels.
TILE = 2 * HALO + 40


def make_enhancer(kind: type[Enhancer] = RetinexEnhancer, width: int = 4, **switches) -> Enhancer:
    """A narrow network whose weights keep the signal's size, so that far influence does not die away."""
    torch.manual_seed(1)
    enhancer = kind(width=width, **switches).eval()
    with torch.no_grad():
        for parameter in enhancer.parameters():
            parameter.mul_(2.5)
    return enhancer


def random_image(height: int, width: int, batch: int = 1) -> Tensor:
    return torch.rand(batch, 3, height, width, generator=torch.Generator().manual_seed(height * width))


@torch.no_grad()
def seam(enhancer: Enhancer, image: Tensor, tile: int) -> float:
    """Largest difference between tiled and whole-image inference."""
    enhancer.tile_pixels = image.shape[2] * image.shape[3]
    whole = enhancer(image)
    enhancer.tile_pixels = tile**2
    return (enhancer(image) - whole).abs().max().item()


@pytest.mark.parametrize("switches", [{}, {"padding": "zeros"}, {"up_kernel": 2, "jump": "concat"}])
@pytest.mark.parametrize(
    ("height", "width"),
    [
        (201, 241),  # the last row and column of tiles are one pixel thin, and reflected up to 8
        (217, 185),  # odd sizes
        (320, 200),  # whole tiles
        (16, 2600),  # thinner than a halo
    ],
)
def test_tiles_leave_no_seams(switches, height, width):
    assert seam(make_enhancer(**switches), random_image(height, width), TILE) <= 1e-5


def test_a_batch_and_the_direct_rival_leave_no_seams():
    assert seam(make_enhancer(DirectEnhancer), random_image(205, 243, batch=2), TILE) <= 1e-5


def test_the_comparison_would_see_a_seam(monkeypatch):
    monkeypatch.setattr(Enhancer, "halo", 40)
    assert seam(make_enhancer(), random_image(217, 185), 2 * 40 + 40) > 1e-4


@pytest.mark.parametrize("switches", [{}, {"up_kernel": 2}])
def test_the_halo_covers_the_receptive_field(switches):
    """Averaging weights keep every path alive: an input has a gradient exactly if the output can depend on it."""
    enhancer = RetinexEnhancer(width=2, activation="none", **switches)
    with torch.no_grad():
        for parameter in enhancer.parameters():
            parameter.fill_(0.1 if parameter.ndim == 1 else 1 / parameter[0].numel())
    reach = 0
    for phase in range(8):  # all places in the grid of 8
        image = random_image(208, 208).requires_grad_()
        enhancer(image)[0, :, 96 + phase, 96 + phase].sum().backward()
        rows, columns = image.grad.abs().sum((0, 1)).nonzero(as_tuple=True)
        assert min(rows.min(), columns.min()) > 0, "the image is too small to measure the field"
        reach = max(reach, *((end - 96 - phase).abs().item() for end in (*rows.aminmax(), *columns.aminmax())))
    # 54 for the convolutions at their scales, and what the steps down and up add (PAPER.md, section 1).
    assert 54 < reach <= HALO
    assert HALO - reach < 8 or switches, "the halo is no larger than the grid demands"


@settings(max_examples=60, deadline=None)
@given(st.integers(16, 700), st.integers(16, 700), st.sampled_from([TILE, 2 * HALO + 8, 2 * HALO + 97]))
def test_every_tile_fits_the_limit_and_the_network(height, width, tile):
    """Tiles start on the grid, hold 16 pixels or more and at most the limit, and cover the image once."""
    image = torch.arange(height * width, dtype=torch.float64).reshape(1, 1, height, width)
    calls = []

    def network(part: Tensor) -> Tensor:
        calls.append(part.shape[2:].numel())
        top, left = divmod(int(part[0, 0, 0, 0]), width)
        assert min(part.shape[2:]) >= 16
        assert (top % 8, left % 8) == (0, 0)
        for start, length, whole in ((top, part.shape[2], height), (left, part.shape[3], width)):
            assert length % 8 == 0 or start + length == whole, "only the image's own border may need reflection"
        return part + 0.5

    assert torch.equal(apply_tiled(network, image, tile**2), image + 0.5)
    assert max(calls) <= tile**2
    assert len(calls) == 1 or height * width > tile**2


def test_large_images_use_tiles_in_evaluation_alone(monkeypatch):
    enhancer = make_enhancer(width=2)
    assert enhancer.tile_pixels == tiles.DEFAULT_TILE_PIXELS <= 1024**2
    seen = []
    whole = enhancer._whole
    monkeypatch.setattr(enhancer, "_whole", lambda part: (seen.append(part.shape[2:].numel()), whole(part))[1])
    enhancer.tile_pixels = TILE**2
    with torch.no_grad():
        enhancer(random_image(300, 300))
        assert len(seen) > 1
        assert max(seen) <= TILE**2
        enhancer.train()(random_image(300, 300))
    assert seen[-1] == 300 * 300


def test_a_limit_below_the_overlap_is_refused():
    with pytest.raises(ValueError, match=f"tile_pixels is 10000, too few .* {(2 * HALO + 64) ** 2} or more"):
        apply_tiled(torch.clone, random_image(200, 200), 10_000)
