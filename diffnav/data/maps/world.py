"""Maps of the embedded world: places far apart, north up, drawn window by window, with exact coordinates."""

import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import torch
from torch import Tensor

from diffnav.data.maps.geo_map import GeoMap, Window
from diffnav.data.maps.pixels import require_inside
from diffnav.data.scenery.view import Size, checked_size, window_homography
from diffnav.data.scenes import World
from diffnav.errors import UserError
from diffnav.geometry.geodesy import EARTH_RADIUS_M, Array, moved
from diffnav.geometry.georeference import AffineGeoreference, LocalMetres
from diffnav.images import quantise, read_image, write_image

# Maps are drawn in squares of this many pixels, each always whole: then any window equals its part of the map to the
# last bit. The tiles of the paper, 1200 x 2400, are whole squares.
BLOCK = 400
# Latitude beyond which degrees of longitude soon vanish.
_HIGHEST_DEG = 80.0


@dataclass(frozen=True)
class WorldMap(GeoMap):
    """A map of the embedded world, which is seen from any height and heading without being resampled.

    world: the landscape. H_map_world: (3, 3) float64, the map's pixels to metres of the world, east and north.
    """

    world: World
    H_map_world: Tensor = field(compare=False)

    def view(self, H_view_map: Tensor, size: Size) -> Tensor:
        """(3, h, w) in [0, 1]: the landscape through H_view_map (3, 3), pixels of the view to pixels of the map."""
        return self.world.render_homography(self.H_map_world @ H_view_map, size)


@dataclass(frozen=True)
class Blocks:
    """The picture of a `WorldMap`, drawn in squares. size: (h, w). folder: where they are kept, if at all."""

    world: World
    H_map_world: Tensor = field(compare=False)
    size: Size
    folder: Path | None

    def read(self, window: Window) -> Tensor:
        """(3, height, width) of the window (top, left, height, width), 8 bit as maps are stored. Raises: ImageError."""
        require_inside(window, self.size)
        top, left, height, width = window
        picture = torch.empty(3, height, width)
        rows = range(top // BLOCK, (top + height - 1) // BLOCK + 1)
        columns = range(left // BLOCK, (left + width - 1) // BLOCK + 1)
        for row, column in product(rows, columns):
            block = self.block(row, column)
            y, x = row * BLOCK - top, column * BLOCK - left
            inside = block[:, max(-y, 0) : height - y, max(-x, 0) : width - x]
            y, x = max(y, 0), max(x, 0)
            picture[:, y : y + inside.shape[1], x : x + inside.shape[2]] = inside
        return picture

    def block(self, row: int, column: int) -> Tensor:
        """(3, BLOCK, BLOCK), less at the map's right and lower edge."""
        file = None if self.folder is None else self.folder / f"{row:03d}_{column:03d}.png"
        if file is not None and file.is_file():
            return read_image(file)
        top, left = row * BLOCK, column * BLOCK
        size = min(BLOCK, self.size[0] - top), min(BLOCK, self.size[1] - left)
        shift = self.H_map_world.new_tensor([[1, 0, left], [0, 1, top], [0, 0, 1]])
        block = quantise(self.world.render_homography(self.H_map_world @ shift, size))
        if file is not None:
            write_image(file, block)
        return block


def world_maps(
    seed: int = 0,
    count: int = 5,
    size: Size = (3600, 7200),
    ground_sample_distance_m: float = 0.3,
    origin: Sequence[float] = (47.0, 8.0),
    spacing_m: float = 50_000.0,
    cache: str | Path | None = None,
) -> list[WorldMap]:
    """`count` maps of one world; nothing is drawn yet, and the first maps are the same for any count.

    Args:
        size: (h, w) pixels. origin: latitude, longitude of the first map's middle, degrees. spacing_m: between the
            middles of neighbours; the maps fill a square that grows to the east and north. cache: folder where what
            has been drawn is kept as PNG; None draws anew each time (3 s per million pixels).
    Raises: UserError if a setting is out of its range, or maps would overlap or lie beyond 80 degrees.
    """
    if count < 1:
        raise UserError(f"maps.count must be 1 or more, got {count}")
    if len(size) != 2 or len(origin) != 2:
        raise UserError(
            f"maps.size must be [height, width] and maps.origin [latitude, longitude], got {size}, {origin}"
        )
    height, width = checked_size((size[0], size[1]))
    if not spacing_m >= max(height, width) * ground_sample_distance_m:
        raise UserError(f"maps.spacing_m must be at least the maps' longer side in metres, got {spacing_m}")
    reach_deg = math.degrees(math.isqrt(count - 1) * spacing_m / EARTH_RADIUS_M)
    if not abs(origin[0]) + reach_deg <= _HIGHEST_DEG:
        raise UserError(f"maps.origin={list(origin)} with {count} maps reaches a pole; choose a lower latitude")
    folder = None if cache is None else Path(cache).expanduser()
    maps = []
    for k in range(count):
        east, north = (spacing_m * step for step in _place(k))
        H = window_homography((east, north), ground_sample_distance_m, 0.0, (height, width))
        home = moved((origin[0], origin[1]), (east, north))
        maps.append(_world_map(f"world_{seed}_{k:04d}", World(seed), H, (height, width), home, folder))
    return maps


def _world_map(name: str, world: World, H: Tensor, size: Size, home: Array, folder: Path | None) -> WorldMap:
    """The map whose pixels H takes to the world; home: latitude, longitude of its middle, the origin of its metres."""
    facts = ["embedded world", world.seed, H.tolist(), size, BLOCK]
    fingerprint = hashlib.sha256(json.dumps(facts).encode()).hexdigest()
    blocks = Blocks(world, H, size, None if folder is None else folder / fingerprint)
    metres = H[0, 0].item()
    transform = (metres, 0.0, -metres * (size[1] - 1) / 2, 0.0, -metres, metres * (size[0] - 1) / 2)
    georeference = AffineGeoreference(size, LocalMetres((home[0].item(), home[1].item())), transform)
    return WorldMap(name, georeference, blocks.read, fingerprint, world, H)


def _place(number: int) -> tuple[int, int]:
    """Column and row of a map in a square that grows shell by shell, so that more maps move none."""
    shell = math.isqrt(number)
    step = number - shell**2
    return (shell, step) if step <= shell else (2 * shell - step, shell)
