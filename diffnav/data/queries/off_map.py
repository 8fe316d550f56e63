"""Queries of places that no map shows, which must not be located: of other worlds, and of real photographs."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import torch
from torch import Tensor

from diffnav.darkness import DarknessModel
from diffnav.data.maps.geo_map import Window
from diffnav.data.maps.view import resampled
from diffnav.data.pairs import photo_seed
from diffnav.data.photos import Photo
from diffnav.data.queries.camera import Camera, Capture, Range, photograph
from diffnav.data.queries.darkened import DarkenedQuery, darkness_seed, is_dark
from diffnav.data.queries.poses import Pose, Poses, excess, placed
from diffnav.data.scenery.view import Size
from diffnav.data.scenes import World
from diffnav.errors import UserError

# The places of other worlds are drawn within this of their origins.
EXTENT_M = 20_000.0


def off_map_queries(
    count: int,
    seed: int = 0,
    *,
    photos: Sequence[Photo] = (),
    ground_sample_distance_m: float = 0.3,
    size: Size = (400, 600),
    heading_deg: float = 0.0,
    scale: Range = (1.0, 1.0),
    tilt: float = 0.0,
    camera: Camera | None = None,
    dark: float = 0.5,
    darkness: DarknessModel | None = None,
) -> list[DarkenedQuery]:
    """`count` pictures with `on_map` False and no truth, taken by the same camera as those of `cut_queries`.

    Without photos each shows a world of its own, rendered when it is read, with known heading and ground sample
    distance. With photos they are parts of these in turn, at the drawn heading and at the drawn scale over the photo's,
    or at the largest that fits into it. The first queries are the same for any `count`.

    Args: ground_sample_distance_m: of the maps, for worlds; the rest as of `cut_queries`.
    Raises: UserError if a setting is out of its range.
    """
    if count < 1:
        raise UserError(f"query_set.off_map must be 1 or more, got {count}")
    poses = Poses(size, heading_deg, scale, tilt)
    camera, darkness = camera or Camera(), darkness or DarknessModel()
    queries = []
    for k in range(count):
        if photos:
            query = _of_photo(k, photos[k % len(photos)], seed, poses, camera)
        else:
            query = _of_world(k, seed, poses, camera, ground_sample_distance_m)
        night = darkness_seed(seed, query.name)
        queries.append(replace(query, dark=is_dark(k, dark), darkness=darkness, seed=night))
    return queries


def _of_world(number: int, seed: int, poses: Poses, camera: Camera, ground_sample_distance_m: float) -> DarkenedQuery:
    name = f"off_map_{seed}_{number:05d}"
    pose, capture = poses.draw(seed, name), camera.draw(photo_seed(seed, f"camera of {name}"))
    place = [(2 * share - 1) * EXTENT_M for share in pose.share]
    H_place_world = torch.tensor([[1, 0, place[0]], [0, 1, place[1]], [0, 0, 1]], dtype=torch.float64)
    H_query_world = H_place_world @ pose.homography(ground_sample_distance_m)
    world = World(photo_seed(seed, f"world of {name}"))
    return DarkenedQuery(
        name=name,
        image=partial(_rendered, world, H_query_world, poses.size, capture),
        on_map=False,
        heading_deg=pose.heading_deg % 360,
        ground_sample_distance_m=pose.scale * ground_sample_distance_m,
        dark=False,
    )


def _of_photo(number: int, photo: Photo, seed: int, poses: Poses, camera: Camera) -> DarkenedQuery:
    name = f"off_map_{seed}_{number:05d}_{photo.name}"
    pose, capture = poses.draw(seed, name), camera.draw(photo_seed(seed, f"camera of {name}"))
    return DarkenedQuery(name=name, image=partial(_part, photo, pose, capture), on_map=False, dark=False)


def _rendered(world: World, H_query_world: Tensor, size: Size, capture: Capture) -> Tensor:
    return photograph(world.render_homography(H_query_world, size), capture)


def _part(photo: Photo, pose: Pose, capture: Capture) -> Tensor:
    """The part of a photo that the pose sees; enlarged, where it would reach beyond the photo. Raises: ImageError."""
    image = photo.read_normal()
    image_size = (image.shape[1], image.shape[2])
    # As if the photo were a map with north up and a metre a pixel.
    H = torch.diag(torch.tensor([1.0, -1.0, 1.0], dtype=torch.float64)) @ pose.homography()
    larger = 1 / max(excess(H, pose.size, image_size), 1.0)
    H_query_photo = placed(torch.diag(torch.tensor([larger, larger, 1.0], dtype=torch.float64)) @ H, pose, image_size)

    def read(window: Window) -> Tensor:
        top, left, height, width = window
        return image[:, top : top + height, left : left + width]

    return photograph(resampled(read, image_size, H_query_photo, pose.size), capture)
