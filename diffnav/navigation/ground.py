"""The ground around a place as a picture: x east, y south, in pixels of a stated size, so that maps can be joined."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from diffnav.geometry.geodesy import bearing_deg, moved, offset_m
from diffnav.geometry.homography import apply_homography, corners_of

Place = tuple[float, float]


@dataclass(frozen=True)
class Ground:
    """A tangent plane. origin: latitude, longitude of pixel (0, 0); pixel_m: metres a pixel."""

    origin: Place
    pixel_m: float

    def points(self, latlon: np.ndarray) -> np.ndarray:
        """Pixels (N, 2) x, y of places (N, 2) latitude, longitude."""
        return offset_m(np.array(self.origin), latlon) / self.pixel_m * [1, -1]

    def latlon(self, points: np.ndarray) -> np.ndarray:
        """Places (N, 2) latitude, longitude of pixels (N, 2) x, y."""
        return moved(np.array(self.origin), points * [self.pixel_m, -self.pixel_m])


@dataclass(frozen=True)
class Pose:
    """How a picture lies on the ground; the fields are those of `Fix`."""

    latitude: float
    longitude: float
    heading_deg: float
    ground_sample_distance_m: float
    footprint: tuple[Place, ...]


def pose_of(H_query_ground: Tensor, size: tuple[int, int], ground: Ground) -> Pose:
    """Where the middle of a picture of `size` (h, w) lies, where its top points and what its pixels measure there.

    Args: H_query_ground (3, 3), the picture's pixels to the ground's.
    """
    height, width = size
    middle = torch.tensor([(width - 1) / 2, (height - 1) / 2], dtype=torch.float64)
    steps = torch.tensor([[0, 0], [0, -0.5], [0, 0.5], [-0.5, 0], [0.5, 0]], dtype=torch.float64)
    seen = apply_homography(H_query_ground, torch.cat([middle + steps, corners_of(size)])).numpy()
    along_x, along_y = seen[4] - seen[3], seen[2] - seen[1]
    area = abs(along_x[0] * along_y[1] - along_x[1] * along_y[0])
    places = ground.latlon(seen)
    # The direction from far apart: neighbouring places differ by too few digits.
    ahead = ground.latlon(seen[None, 0] - along_y / np.linalg.norm(along_y) * 100 / ground.pixel_m)[0]
    return Pose(
        float(places[0, 0]),
        float(places[0, 1]),
        float(bearing_deg(places[0], ahead)) % 360,
        float(np.sqrt(area)) * ground.pixel_m,
        tuple((float(latitude), float(longitude)) for latitude, longitude in places[5:]),
    )
