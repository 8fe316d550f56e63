"""Large images through a network in overlapping tiles, within a memory limit."""

import math
from collections.abc import Callable

import torch
from torch import Tensor

# Beyond 68 pixels on each side no output of the two networks depends on an input: 8 for Decom-Net's convolutions,
# 46 for Enhance-Net's, 14 for its steps down and up (a test measures the sum). Rounded up to the grid of 8.
HALO = 72
# A tile of 640 x 640 with its halo. In float32 the `compact` network takes 1.6 to 2.4 GB per Mpx of a tile, as
# the allocator has it, `paper` 2.5 times as much; the rest of a 7200 x 3600 image takes 1 GB.
DEFAULT_TILE_PIXELS = 409_600


def apply_tiled(network: Callable[[Tensor], Tensor], image: Tensor, tile_pixels: int) -> Tensor:
    """`network(image)`, computed tile by tile where the image has more than `tile_pixels` pixels.

    Tiles start at multiples of 8, the grid of the networks, and overlap by `HALO` on each side; only the part of a
    tile whose receptive field lies inside it is kept, so seams do not exist.

    Args: image (B, 3, H, W); `network` keeps the size. Returns: (B, 3, H, W).
    Raises: ValueError if a tile could not hold its own halo.
    """
    height, width = image.shape[2:]
    if height * width <= tile_pixels:
        return network(image)
    core = int(math.sqrt(tile_pixels)) // 8 * 8 - 2 * HALO
    if core < 8:
        raise ValueError(f"tile_pixels is {tile_pixels}, too few for the overlap; use {(2 * HALO + 64) ** 2} or more")
    result = torch.empty_like(image)
    for top in range(0, height, core):
        for left in range(0, width, core):
            y0, x0 = max(top - HALO, 0), max(left - HALO, 0)
            y1, x1 = min(top + core + HALO, height), min(left + core + HALO, width)
            tile = network(image[:, :, y0:y1, x0:x1])
            bottom, right = min(top + core, height), min(left + core, width)
            result[:, :, top:bottom, left:right] = tile[:, :, top - y0 : bottom - y0, left - x0 : right - x0]
    return result
