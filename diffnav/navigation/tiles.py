"""How a map is cut into tiles: windows (top, left, height, width) that cover it."""

import math

from diffnav.data.maps.geo_map import Window
from diffnav.errors import UserError

Size = tuple[int, int]


def tile_windows(map_size: Size, tile_size: Size, overlap: float = 0.0) -> list[Window]:
    """The tiles of a map, row by row from its top left.

    Args:
        map_size, tile_size: (h, w) in pixels; a tile larger than the map is cut to it.
        overlap: share of a tile that the next one shows again at least, [0, 1). The tiles are spread evenly, the last
            ends at the map's edge: where sizes do not divide, they overlap a little more. A map of 3600 x 7200 in tiles
            of 1200 x 2400 gives the paper's 3 x 3 without overlap.
    Raises: UserError for a setting out of range.
    """
    if len(tile_size) != 2 or any(not isinstance(side, int) or side < 32 for side in tile_size):
        raise UserError(f"tiles.size must be [height, width] in pixels, each 32 or more, got {list(tile_size)}")
    if not 0 <= overlap < 1:
        raise UserError(f"tiles.overlap must be in [0, 1), got {overlap}")
    rows, columns = (
        _starts(length, min(side, length), overlap) for length, side in zip(map_size, tile_size, strict=True)
    )
    height, width = (min(side, length) for length, side in zip(map_size, tile_size, strict=True))
    return [(top, left, height, width) for top in rows for left in columns]


def _starts(length: int, side: int, overlap: float) -> list[int]:
    """Where tiles of `side` begin along a length, the last of them ending at its end."""
    # Whole pixels: rounding must not leave less overlap than was asked for.
    step = max(1, math.floor(side * (1 - overlap) + 1e-6))
    count = math.ceil((length - side) / step) + 1
    return [round(k * (length - side) / (count - 1)) if count > 1 else 0 for k in range(count)]
