"""What a camera sees of a map: any window of it, turned, scaled and tilted by a homography."""

import math
from collections.abc import Callable

import torch
from torch import Tensor
from torch.nn.functional import avg_pool2d

from diffnav.data.maps.geo_map import GeoMap, Window
from diffnav.data.maps.world import WorldMap
from diffnav.geometry.homography import apply_homography, corners_of
from diffnav.geometry.views import Size, draw_view


def map_view(geo_map: GeoMap, H_view_map: Tensor, size: Size) -> Tensor:
    """(3, h, w) in [0, 1]: what a view of `size` (h, w) sees of a map on which it lies.

    H_view_map: (3, 3), pixels of the view to pixels of the map. The embedded world is rendered, any other map is
    resampled. Raises: ImageError.
    """
    if isinstance(geo_map, WorldMap):
        return geo_map.view(H_view_map, size)
    return resampled(geo_map.read, geo_map.size, H_view_map, size)


def resampled(read: Callable[[Window], Tensor], image_size: Size, H_view_image: Tensor, size: Size) -> Tensor:
    """(3, h, w): a view of `size` (h, w) on an image of `image_size`, of which only the part that it shows is read.

    Where more than two image pixels fall on a pixel of the view, squares of the image are averaged first, so that
    `draw_view` leaves no aliases. read, H_view_image: as of `map_view`. What lies beyond the image is mirrored.
    """
    corners = corners_of(size)
    seen = apply_homography(H_view_image, corners)
    side = max(math.ceil(_largest_step(H_view_image, corners) / 2 - 1e-6), 1)
    # For the outermost pixels' area, the interpolation, and squares that the window's edge cuts.
    margin = 2 * side
    left, top = (max(math.floor(value) - margin, 0) for value in seen.amin(0).tolist())
    right, bottom = (
        min(math.ceil(value) + margin + 1, length)
        for value, length in zip(seen.amax(0).tolist(), image_size[::-1], strict=True)
    )
    if left >= right or top >= bottom:
        raise ValueError(f"the view from ({left}, {top}) to ({right}, {bottom}) lies beyond the image")
    image = read((top, left, bottom - top, right - left))
    if side > 1:
        image = avg_pool2d(image[None], side, ceil_mode=True)[0]
    # Pixel centres: x of the image is (x - left + 0.5) / side - 0.5 of what is drawn.
    shrink = [[1 / side, 0, (0.5 - left) / side - 0.5], [0, 1 / side, (0.5 - top) / side - 0.5], [0, 0, 1]]
    return draw_view(image, torch.tensor(shrink, dtype=torch.float64) @ H_view_image, size)


def _largest_step(H_view_image: Tensor, points: Tensor) -> float:
    """How many image pixels a step of one pixel of the view covers at most, at these points."""
    here = apply_homography(H_view_image, points)
    steps = [
        apply_homography(H_view_image, points + points.new_tensor(step)) - here for step in ((1.0, 0.0), (0.0, 1.0))
    ]
    return max(step.norm(dim=1).max().item() for step in steps)
