"""The embedded street as a driving set: a drive by a pair of cameras, rendered when its pictures are read."""

import math
from collections.abc import Sequence
from functools import partial

from torch import Tensor

from diffnav.data.driving.driving_set import DrivingSet, Frame
from diffnav.data.driving.pairing import pair_frames
from diffnav.data.driving.street.camera import StreetCamera
from diffnav.data.driving.street.street import render
from diffnav.data.scenery.view import checked_size
from diffnav.errors import UserError
from diffnav.images import quantise

# Of the left camera: in the right lane, as high as a roof.
LANE_M, HEIGHT_M = 1.6, 1.65
# Nobody drives straight: metres to either side, and metres of road that a sway takes.
SWAY_M, SWAY_LENGTH_M = 0.25, 45.0
FOCAL_WIDTHS = 0.8
FRAMES_PER_S = 10.0


def scenes_drive(
    count: int, seed: int = 0, size: Sequence[int] = (352, 640), step_m: float = 1.5, baseline_m: float = 0.5
) -> DrivingSet:
    """`count` pairs along the street of a seed: left pictures as queries, right ones as references; none rendered yet.

    Args:
        size: (h, w) pixels; the focal length is 0.8 w. step_m: metres from frame to frame. baseline_m: metres from
            the left camera to the right one. The first frames are the same for any count.
    Raises: UserError if count is below 1, a length is not above 0, or the cameras leave the road.
    """
    if count < 1:
        raise UserError(f"data.count must be 1 or more, got {count}")
    for name, length_m, most in (("step_m", step_m, 1000), ("baseline_m", baseline_m, 2)):
        if not 0 < length_m <= most:
            raise UserError(f"data.{name} must be above 0 and at most {most}, got {length_m}")
    shape = checked_size((size[0], size[1]))
    sides: tuple[list[Frame], list[Frame]] = [], []
    for side, camera, offset_m in zip(sides, ("left", "right"), (0.0, baseline_m), strict=True):
        for k in range(count):
            x, y, z = drive_position(k * step_m)
            seen = StreetCamera((x + offset_m, y, z), FOCAL_WIDTHS * shape[1], shape)
            side.append(
                Frame(
                    name=f"{camera}/{seed}_{k:06d}",
                    # A function of the module, not a lambda: frames go to worker processes by pickle.
                    picture=partial(photograph, seed, seen),
                    camera=camera,
                    record=f"street_{seed}",
                    moment=f"{k:06d}",
                    time_s=k / FRAMES_PER_S,
                    position_m=seen.position_m,
                    world=f"street_{seed}",
                )
            )
    return pair_frames("scenes_drive", *sides, consecutive=True, rectified=True)


def drive_position(driven_m: float) -> tuple[float, float, float]:
    """x, y, z of the left camera in the street's frame after so many metres along the street."""
    return LANE_M + SWAY_M * math.sin(2 * math.pi * driven_m / SWAY_LENGTH_M), -HEIGHT_M, driven_m


def photograph(seed: int, camera: StreetCamera) -> Tensor:
    """The street as a camera would store it: (3, h, w) in [0, 1], 8 bit."""
    return quantise(render(seed, camera)[0])
