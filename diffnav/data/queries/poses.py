"""How a camera may look down: heading, scale, tilt and place of a picture, drawn from a seed and a name."""

import math
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from diffnav.data.pairs import photo_seed
from diffnav.data.queries.camera import Range, checked_range
from diffnav.data.scenery.view import Size, checked_size, window_homography
from diffnav.errors import UserError
from diffnav.geometry.homography import apply_homography, corners_of
from diffnav.geometry.views import view_homography


@dataclass(frozen=True)
class Pose:
    """One drawn pose of a picture of `size` (h, w).

    heading_deg: of the picture's top, clockwise from north. scale: ground sample distance over the map's. tilt: (x, y),
    the divisor at the picture's edges is 1 +- tilt. share: (x, y) in [0, 1], where in the room that there is.
    """

    size: Size
    heading_deg: float
    scale: float
    tilt: tuple[float, float]
    share: tuple[float, float]

    def homography(self, ground_sample_distance_m: float = 1.0) -> Tensor:
        """H_picture_ground (3, 3) float64: pixels to metres east and north of the picture's middle.

        ground_sample_distance_m: of the map. At the middle the tilt changes neither heading nor scale.
        """
        straight = window_homography((0.0, 0.0), self.scale * ground_sample_distance_m, self.heading_deg, self.size)
        return straight @ view_homography(self.size, 0.0, 1.0, tilt=self.tilt)


@dataclass(frozen=True)
class Poses:
    """The distribution that poses are drawn from.

    size: (h, w) of the pictures, pixels. heading_deg: drawn from +- this, 0 to 180. scale: ground sample distance over
    the map's, drawn from (low, high) evenly on a logarithmic scale, 0.01 to 100. tilt: along each axis drawn from +-
    this, below 0.3.

    Raises: UserError if one of them is out of its range.
    """

    size: Size = (400, 600)
    heading_deg: float = 0.0
    scale: Range = (1.0, 1.0)
    tilt: float = 0.0

    def __post_init__(self) -> None:
        if len(self.size) != 2:
            raise UserError(f"query_set.size must be [height, width] in pixels, got {self.size}")
        object.__setattr__(self, "size", checked_size((self.size[0], self.size[1])))
        object.__setattr__(self, "scale", checked_range("query_set.scale", self.scale, 0.01, 100))
        if not 0 <= self.heading_deg <= 180:
            raise UserError(f"query_set.heading_deg must be from 0 to 180, got {self.heading_deg}")
        if not 0 <= self.tilt < 0.3:
            raise UserError(f"query_set.tilt must be 0 or more and below 0.3, got {self.tilt}")

    def draw(self, seed: int, name: str) -> Pose:
        """The pose of the picture of this name: the same whatever other pictures there are."""
        dice = np.random.default_rng(photo_seed(seed, f"pose of {name}"))
        heading_deg = float(dice.uniform(-self.heading_deg, self.heading_deg)) if self.heading_deg else 0.0
        scale = math.exp(dice.uniform(*np.log(self.scale)))
        x, y = (float(value) for value in dice.uniform(-self.tilt, self.tilt, 2))
        u, v = (float(value) for value in dice.random(2))
        return Pose(self.size, heading_deg, scale, (x, y), (u, v))


def excess(H: Tensor, size: Size, map_size: Size) -> float:
    """How many times larger than a map of `map_size` (h, w) a picture of `size` is, along the worse axis.

    H: (3, 3), the picture's pixels to pixels of the map, up to a shift. Up to 1 the picture can lie wholly on the map.
    """
    low, high = _box(H, size)
    return ((high - low) / torch.tensor(map_size[::-1])).max().item()


def placed(H: Tensor, pose: Pose, map_size: Size) -> Tensor:
    """H (3, 3) moved so that the picture lies on the map, at the pose's share of the room; see `excess`."""
    low, high = _box(H, pose.size)
    room = torch.tensor(map_size[::-1]) - (high - low)
    shift = torch.eye(3, dtype=torch.float64)
    shift[:2, 2] = torch.tensor(pose.share, dtype=torch.float64) * room.clamp(min=0) - 0.5 - low
    return shift @ H


def _box(H: Tensor, size: Size) -> tuple[Tensor, Tensor]:
    """Least and largest x, y that H gives to the outer corners of a picture's pixels, (2,) float64 each."""
    outwards = torch.tensor([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]], dtype=torch.float64)
    outline = apply_homography(H, corners_of(size) + outwards)
    return outline.amin(0), outline.amax(0)
