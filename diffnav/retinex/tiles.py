"""Large images through a network in overlapping tiles, within a memory limit; `TiledEnhancer`, which does so."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor, nn

# Beyond 68 pixels on each side no output of the two Retinex networks depends on an input: 8 for Decom-Net's
# convolutions, 46 for Enhance-Net's, 14 for its steps down and up (a test measures the sum). Rounded up to 8's grid.
HALO = 72
# A tile of 640 x 640 with its halo. In float32 the `compact` network takes 1.6 to 2.4 GB per Mpx of a tile, as
# the allocator has it, `paper` 2.5 times as much; the rest of a 7200 x 3600 image takes 1 GB.
DEFAULT_TILE_PIXELS = 409_600


class TiledEnhancer(nn.Module):
    """An enhancer with weights: what it takes to call, save and rebuild it, whatever its layers.

    `settings` (the constructor's arguments) rebuild it. In evaluation mode, images of more than `tile_pixels` go
    through in tiles that overlap by `halo`, a multiple of 8 that covers the receptive field. `sha256` is that of the
    weights file it was read from, if it was.
    """

    settings: dict[str, Any]
    sha256: str | None = None
    halo: int
    tile_pixels: int = DEFAULT_TILE_PIXELS

    def forward(self, image: Tensor, record: Sequence[Any] | None = None) -> Tensor:  # noqa: ARG002
        """The enhanced image, (B, 3, H, W) in [0, 1] -> the same; `record` (of the darkening) is not looked at."""
        if self.training:
            return self._whole(image)
        return apply_tiled(self._whole, image, self.tile_pixels, self.halo).clamp(0, 1)

    def _whole(self, image: Tensor) -> Tensor:
        """The enhanced image in one piece, not yet clipped."""
        raise NotImplementedError

    @property
    def parameter_count(self) -> int:
        return sum(p.numel() for p in self.parameters())


def apply_tiled(network: Callable[[Tensor], Tensor], image: Tensor, tile_pixels: int, halo: int = HALO) -> Tensor:
    """`network(image)`, computed tile by tile where the image has more than `tile_pixels` pixels.

    Tiles start at multiples of 8, the grid of the networks, and overlap by `halo` on each side; only the part of a
    tile whose receptive field lies inside it is kept, so seams do not exist.

    Args: image (B, 3, H, W); `network` keeps the size. Returns: (B, 3, H, W).
    Raises: ValueError if a tile could not hold its own halo.
    """
    height, width = image.shape[2:]
    if height * width <= tile_pixels:
        return network(image)
    core = int(math.sqrt(tile_pixels)) // 8 * 8 - 2 * halo
    if core < 8:
        raise ValueError(f"tile_pixels is {tile_pixels}, too few for the overlap; use {(2 * halo + 64) ** 2} or more")
    result = torch.empty_like(image)
    for top in range(0, height, core):
        for left in range(0, width, core):
            y0, x0 = max(top - halo, 0), max(left - halo, 0)
            y1, x1 = min(top + core + halo, height), min(left + core + halo, width)
            tile = network(image[:, :, y0:y1, x0:x1])
            bottom, right = min(top + core, height), min(left + core, width)
            result[:, :, top:bottom, left:right] = tile[:, :, top - y0 : bottom - y0, left - x0 : right - x0]
    return result
