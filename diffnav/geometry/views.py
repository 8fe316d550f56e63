"""Views of an image through a homography: drawn ones, how they look, and which of their pixels show the image."""

import math
from collections.abc import Sequence

import torch
from torch import Tensor
from torch.nn.functional import grid_sample

from diffnav.geometry.homography import apply_homography

Size = tuple[int, int]


def view_homography(
    size: Size,
    angle_rad: float,
    zoom: float,
    shift_px: tuple[float, float] = (0.0, 0.0),
    tilt: tuple[float, float] = (0.0, 0.0),
) -> Tensor:
    """H_view_image (3, 3) float64: tilt about the middle, turn, zoom, move; view and image are of `size` (h, w).

    Args:
        angle_rad: turn from x towards y (down). zoom: image pixels per view pixel. shift_px: (x, y) of the view's
            middle from the image's. tilt: (x, y); the divisor at the view's edges is 1 +- tilt.
    """
    height, width = size
    mid_x, mid_y = (width - 1) / 2, (height - 1) / 2
    c, s = math.cos(angle_rad) * zoom, math.sin(angle_rad) * zoom
    from_middle = _matrix([[1, 0, -mid_x], [0, 1, -mid_y], [0, 0, 1]])
    tilted = _matrix([[1, 0, 0], [0, 1, 0], [tilt[0] * 2 / width, tilt[1] * 2 / height, 1]])
    turned = _matrix([[c, -s, mid_x + shift_px[0]], [s, c, mid_y + shift_px[1]], [0, 0, 1]])
    return turned @ tilted @ from_middle


def draw_view(image: Tensor, H_view_image: Tensor, size: Size) -> Tensor:
    """`draw_views` of one image (3, H, W) and one homography (3, 3): (3, h, w)."""
    return draw_views(image[None], H_view_image[None], size)[0]


def draw_views(images: Tensor, H_view_image: Tensor, size: Size) -> Tensor:
    """What views of `size` (h, w) see of images (B, 3, H, W): (B, 3, h, w); beyond its edges an image is mirrored.

    Each pixel is the mean of 2 x 2 bilinear samples inside it, so that shrinking by up to a half leaves no aliases.
    Not meant for gradients with respect to H_view_image, (B, 3, 3).
    """
    pixels = pixel_grid(size).to(images.device)
    largest = pixels.new_tensor([images.shape[3] - 1, images.shape[2] - 1]).clamp(min=1)
    views = images.new_zeros(*images.shape[:2], *size)
    for offset in ((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)):
        seen = apply_homography(H_view_image, pixels + pixels.new_tensor(offset))
        grid = (2 * seen / largest - 1).reshape(-1, *size, 2).to(images)
        views += grid_sample(images, grid, padding_mode="reflection", align_corners=True) / 4
    return views


def shows_image(H_view_image: Tensor, size: Size, image_size: Size) -> Tensor:
    """Which pixels of the view of `size` (h, w) see the image of `image_size`, not what lies beyond it: (h, w) bool."""
    return inside(apply_homography(H_view_image, pixel_grid(size)), image_size).reshape(size)


def inside(points: Tensor, size: Size) -> Tensor:
    """Which of the points (..., 2) lie between the first and the last pixel's centre of an image (h, w): (...) bool."""
    last = torch.tensor([size[1] - 1, size[0] - 1], device=points.device)
    return ((points >= 0) & (points <= last)).all(-1)


def pixel_grid(size: Size) -> Tensor:
    """The centres of all pixels, row by row: (h w, 2) float64, x, y."""
    y, x = torch.meshgrid(*(torch.arange(side, dtype=torch.float64) for side in size), indexing="ij")
    return torch.stack([x.flatten(), y.flatten()], 1)


def _matrix(rows: Sequence[Sequence[float]]) -> Tensor:
    return torch.tensor(rows, dtype=torch.float64)
