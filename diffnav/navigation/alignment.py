"""A query turned north-up and brought to a map's scale, as far as its heading and scale are known."""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from diffnav.geometry.homography import apply_homography, corners_of
from diffnav.geometry.views import draw_view
from diffnav.images import resize
from diffnav.matching.matches import Features, Matcher

# Keypoints this near to the border of a turned picture describe its corners, where the query is mirrored.
_MARGIN_PX = 4.0


@dataclass(frozen=True)
class Aligned:
    """A turned and scaled picture (3, h, w), the homography to it from the query, and the query's size (h, w)."""

    image: Tensor
    H_query_aligned: Tensor
    query_size: tuple[int, int]

    def features(self, matcher: Matcher) -> Features:
        """The aligned picture's features, in pixels of the aligned picture; those outside of the query are dropped."""
        found = matcher.features(self.image)
        back = apply_homography(torch.linalg.inv(self.H_query_aligned), found.keypoints)
        height, width = self.query_size
        scale = math.sqrt(abs(float(torch.linalg.det(self.H_query_aligned[:2, :2]))))
        margin = _MARGIN_PX / scale if self.turned else -1.0
        size = torch.tensor([width - 1, height - 1], dtype=torch.float64)
        inside = ((back >= margin) & (back <= size - margin)).all(1)
        return Features(found.keypoints[inside], found.descriptors[inside], found.scores[inside], found.size)

    @property
    def turned(self) -> bool:
        """Whether the query was turned, so that corners of the picture show nothing of it."""
        return bool(self.H_query_aligned[0, 1] != 0)


def align(image: Tensor, scale: float = 1.0, heading_deg: float = 0.0) -> Aligned:
    """A picture (3, H, W) scaled, then turned clockwise by the heading of its top: north is up after it.

    Args: scale: pixels of the result per pixel of the picture.
    """
    size = (image.shape[1], image.shape[2])
    height, width = (max(1, round(side * scale)) for side in size)
    scaled = image if (height, width) == size else resize(image, (height, width))
    H_scale = _scaling(size, (height, width))
    if heading_deg % 360 == 0:
        return Aligned(scaled, H_scale, size)
    H_turn, turned_size = _turning((height, width), heading_deg)
    turned = draw_view(scaled, torch.linalg.inv(H_turn), turned_size)
    return Aligned(turned, H_turn @ H_scale, size)


def _scaling(size: tuple[int, int], scaled: tuple[int, int]) -> Tensor:
    """Pixels of a picture to those of its resized copy: x' = (x + .5) s - .5."""
    y, x = (new / old for new, old in zip(scaled, size, strict=True))
    return torch.tensor([[x, 0, (x - 1) / 2], [0, y, (y - 1) / 2], [0, 0, 1]], dtype=torch.float64)


def _turning(size: tuple[int, int], angle_deg: float) -> tuple[Tensor, tuple[int, int]]:
    """The clockwise turn about the middle into the smallest upright picture that holds all, and that one's size."""
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    turn = torch.tensor([[c, -s, 0], [s, c, 0], [0, 0, 1]], dtype=torch.float64)
    corners = apply_homography(turn, corners_of(size))
    low, high = corners.amin(0), corners.amax(0)
    turn[:2, 2] = -low
    # Less rounding, which would make a quarter turn a pixel larger.
    width, height = ((high - low - 1e-6).ceil().int() + 1).tolist()
    return turn, (height, width)
