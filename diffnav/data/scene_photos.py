"""The embedded world as a data set: windows of it as photos that are rendered when they are read."""

from collections.abc import Sequence
from functools import partial

from torch import Tensor

from diffnav.data.photos import Photo
from diffnav.data.scenes import SceneWindows, Window
from diffnav.errors import UserError
from diffnav.images import quantise


def scene_photos(
    count: int,
    seed: int = 0,
    size: Sequence[int] = (400, 600),
    ground_sample_distance_m: Sequence[float] = (0.1, 0.4),
    extent_m: float = 20_000.0,
) -> list[Photo]:
    """`count` windows of the embedded world as daylight photos, each a site of its own; nothing is rendered yet.

    Args:
        size: (h, w) pixels. ground_sample_distance_m: (least, most) metres per pixel. extent_m: how far from the
            origin places are drawn. The first photos are the same for any count.
    Raises: UserError if count is below 1, or the scenery refuses its settings.
    """
    if count < 1:
        raise UserError(f"data.photos.count must be 1 or more, got {count}")
    windows = SceneWindows(
        seed, count, (size[0], size[1]), (ground_sample_distance_m[0], ground_sample_distance_m[1]), extent_m
    ).windows
    # Functions of the module, not lambdas: photos go to worker processes by pickle.
    return [Photo(name=window.name, site=window.name, normal=partial(_photograph, window)) for window in windows]


def _photograph(window: Window) -> Tensor:
    """The window as a camera would store it: (3, h, w) in [0, 1], 8 bit."""
    return quantise(window.render())
