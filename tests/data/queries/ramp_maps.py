"""Maps whose colours are the positions in them, and queries that leave these colours alone."""

import math

import torch

from diffnav.data.maps.geo_map import GeoMap, Window
from diffnav.data.queries.camera import Camera
from diffnav.geometry.georeference import Georeference, bounds_georeference

DEGREE_M = math.radians(1) * 6_371_008.8
SIZE = (20, 30)
ANY = {"size": SIZE, "heading_deg": 180.0, "scale": (0.5, 2.0)}
# A camera that changes nothing but to 8 bit.
PURE = Camera((0, 0), 0, 0, (0, 0), 0)


class Ramp:
    """A picture whose red is x / width, whose green is y / height."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.size = size

    def __call__(self, window: Window) -> torch.Tensor:
        top, left, height, width = window
        x = (torch.arange(left, left + width) / self.size[1]).expand(height, -1)
        y = (torch.arange(top, top + height) / self.size[0])[:, None].expand(-1, width)
        return torch.stack([x, y, torch.zeros(height, width)])


def ramp_map(georeference: Georeference, name: str = "ramp") -> GeoMap:
    return GeoMap(name, georeference, Ramp(georeference.size), name)


def degrees_map(name: str = "ramp") -> GeoMap:
    """240 x 160 pixels of 0.5 m by 0.3 m at 60 N, even in degrees."""
    north, west = 60.0, 24.0
    south, east = north - 160 * 0.3 / DEGREE_M, west + 240 * 0.5 / (DEGREE_M * math.cos(math.radians(60)))
    return ramp_map(bounds_georeference((160, 240), north, west, south, east), name)
