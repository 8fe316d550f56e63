"""Queries cut from maps, with exact truth: the paper's experiment, and any other heading, scale and appearance."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import torch
from torch import Tensor

from diffnav.darkness import DarknessModel
from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.maps.view import map_view
from diffnav.data.pairs import photo_seed
from diffnav.data.queries.camera import Camera, Capture, Range, photograph
from diffnav.data.queries.darkened import DarkenedQuery, darkness_seed, is_dark
from diffnav.data.queries.poses import Pose, Poses, excess, placed
from diffnav.data.scenery.view import Size
from diffnav.errors import UserError
from diffnav.geometry.georeference import metres_per_pixel
from diffnav.geometry.homography import apply_homography

# A picture as large as its map still fits.
_ROUNDING = 1e-6


@dataclass(frozen=True, kw_only=True)
class CutQuery(DarkenedQuery):
    """A picture cut from a map: truth, heading and ground sample distance are exact, at the picture's middle.

    map: the map's name. H_query_map: (3, 3) float64, pixels of the picture to pixels of that map. capture: what the
    camera made of the view.
    """

    map: str
    H_query_map: Tensor = field(compare=False)
    capture: Capture


def cut_queries(
    maps: Sequence[GeoMap],
    per_map: int,
    seed: int = 0,
    *,
    size: Size = (400, 600),
    heading_deg: float = 0.0,
    scale: Range = (1.0, 1.0),
    tilt: float = 0.0,
    camera: Camera | None = None,
    dark: float = 0.5,
    darkness: DarknessModel | None = None,
) -> list[CutQuery]:
    """`per_map` pictures of each map, map by map; nothing is read or rendered until a query is.

    The embedded world renders them, of other maps they are resampled (`map_view`); each lies wholly on its map. What is
    drawn depends on `seed`, the map and the query's number alone: the first queries are the same for any `per_map`.

    Args:
        size, heading_deg, scale, tilt: see `Poses`; a heading of 0 is level flight to the north. camera: appearance;
            `Camera()` where none is given. dark: share of each map's pictures that is delivered dark, exact where it
            divides `per_map`. darkness: Eq. 9 as in the paper where none is given.
    Raises: UserError if a setting is out of its range, or a map is smaller than a picture's footprint.
    """
    if per_map < 1:
        raise UserError(f"query_set.per_map must be 1 or more, got {per_map}")
    poses = Poses(size, heading_deg, scale, tilt)
    camera, darkness = camera or Camera(), darkness or DarknessModel()
    queries = []
    for geo_map in maps:
        for k in range(per_map):
            name = f"{geo_map.name}_{k:04d}"
            capture = camera.draw(photo_seed(seed, f"camera of {name}"))
            query = _cut(name, geo_map, poses.draw(seed, name), capture)
            night = darkness_seed(seed, name)
            queries.append(replace(query, dark=is_dark(k, dark), darkness=darkness, seed=night))
    return queries


def _cut(name: str, geo_map: GeoMap, pose: Pose, capture: Capture) -> CutQuery:
    """The query of this pose, by day. Raises: UserError."""
    H = _homography(geo_map, pose)
    middle = (torch.tensor(pose.size[::-1], dtype=torch.float64) - 1) / 2
    centre = apply_homography(H, middle[None])[0].numpy()
    latitude, longitude = geo_map.georeference.latlon(centre).tolist()
    # Map pixels (rows x, y) for a step along x and y of the picture (columns).
    before, after = (apply_homography(H, middle + side * torch.eye(2)) for side in (-0.5, 0.5))
    ground = metres_per_pixel(geo_map.georeference, centre) @ (after - before).mT.numpy()
    return CutQuery(
        name=name,
        image=partial(_taken, geo_map, H, pose.size, capture),
        truth=(latitude, longitude),
        # Up in the picture is -y.
        heading_deg=math.degrees(math.atan2(-ground[0, 1], -ground[1, 1])) % 360,
        ground_sample_distance_m=math.sqrt(abs(np.linalg.det(ground))),
        dark=False,
        map=geo_map.name,
        H_query_map=H,
        capture=capture,
    )


def _homography(geo_map: GeoMap, pose: Pose) -> Tensor:
    """H_query_map (3, 3) float64 of the pose, on the ground as it is at the map's middle. Raises: UserError."""
    height, width = geo_map.size
    ground = metres_per_pixel(geo_map.georeference, [(width - 1) / 2, (height - 1) / 2])
    H_ground_map = torch.eye(3, dtype=torch.float64)
    H_ground_map[:2, :2] = torch.from_numpy(np.linalg.inv(ground))
    H_query_map = H_ground_map @ pose.homography(math.sqrt(abs(np.linalg.det(ground))))
    too_large = excess(H_query_map, pose.size, geo_map.size)
    if too_large > 1 + _ROUNDING:
        raise UserError(
            f"map {geo_map.name} of {width} x {height} pixels is {too_large:.2f} times too small for a query of "
            f"{pose.size[1]} x {pose.size[0]} at scale {pose.scale:.2f} and heading {pose.heading_deg:.0f} degrees; "
            "lower query_set.size or query_set.scale, or leave the map out"
        )
    return placed(H_query_map, pose, geo_map.size)


def _taken(geo_map: GeoMap, H_query_map: Tensor, size: Size, capture: Capture) -> Tensor:
    """The daylight picture. Raises: ImageError."""
    return photograph(map_view(geo_map, H_query_map, size), capture)
