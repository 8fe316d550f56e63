"""Random views of a picture: any turn, some zoom, some perspective."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from torch import Tensor

from diffnav.data.pair_source import PairSource
from diffnav.data.pairs import photo_seed
from diffnav.data.photos import Photo
from diffnav.errors import UserError
from diffnav.geometry.views import Size, view_homography


@dataclass(frozen=True)
class RandomViews:
    """The distribution that views are drawn from.

    rotation_deg: the turn is drawn from +- this. scale: how large things are in the view, against the picture, drawn
    from (low, high) evenly on a logarithmic scale. perspective: the tilt; along each axis the divisor at the edges
    is 1 +- a number of up to this.

    Raises: UserError if one of them is out of its range.
    """

    rotation_deg: float = 180.0
    scale: tuple[float, float] = (0.7, 1.4)
    perspective: float = 0.1

    def __post_init__(self) -> None:
        object.__setattr__(self, "scale", tuple(self.scale))
        if len(self.scale) != 2 or not 0 < self.scale[0] <= self.scale[1] < math.inf:
            raise UserError(f"pairs.scale must be two numbers above 0, low and high; got {list(self.scale)}")
        if not 0 <= self.rotation_deg <= 180:
            raise UserError(f"pairs.rotation_deg must be from 0 to 180, got {self.rotation_deg}")
        if not 0 <= self.perspective < 0.5:
            raise UserError(f"pairs.perspective must be 0 or more and below 0.5, got {self.perspective}")

    def draw(self, size: Size, seed: int, name: str) -> Tensor:
        """H_view_image (3, 3) float64 for the picture of this name: the same whatever other pictures there are."""
        dice = np.random.default_rng(photo_seed(seed, f"view of {name}"))
        angle_deg = dice.uniform(-self.rotation_deg, self.rotation_deg)
        scale = math.exp(dice.uniform(math.log(self.scale[0]), math.log(self.scale[1])))
        tilt_x, tilt_y = dice.uniform(-self.perspective, self.perspective, 2)
        return view_homography(size, math.radians(angle_deg), 1 / scale, tilt=(float(tilt_x), float(tilt_y)))


class RandomViewPairs:
    """What pairs with random views share: the source of their pictures, and the views. Arguments: see `RandomViews`."""

    def __init__(
        self,
        source: PairSource,
        rotation_deg: float = 180.0,
        scale: tuple[float, float] = (0.7, 1.4),
        perspective: float = 0.1,
    ) -> None:
        self.source = source
        self.views = RandomViews(rotation_deg, scale, perspective)

    @property
    def photos(self) -> Sequence[Photo]:
        return self.source.photos
