"""Training pictures varied before they are darkened: seen from further away, exposed differently."""

import math
from dataclasses import dataclass

import numpy as np

from diffnav.errors import UserError
from diffnav.images import from_uint8, resize, to_uint8

Range = tuple[float, float]


@dataclass(frozen=True)
class Variation:
    """How far training patches go beyond the photos themselves; (1, 1) leaves them as they are.

    zoom: factor that a picture is shrunk by, drawn from (low, high), at most 1. exposure: exponent on the daylight
    picture, drawn from (low, high), so that a network cannot learn by heart how bright a kind of place is. Both are
    drawn evenly on a logarithmic scale.

    Raises: UserError if a range is not two positive numbers in order, or zoom passes 1.
    """

    zoom: Range = (1.0, 1.0)
    exposure: Range = (1.0, 1.0)

    def __post_init__(self) -> None:
        for name in ("zoom", "exposure"):
            values = tuple(getattr(self, name))
            if len(values) != 2 or not 0 < values[0] <= values[1] < math.inf:
                raise UserError(f"data.variation.{name} must be two numbers above 0, low and high; got {list(values)}")
            object.__setattr__(self, name, values)
        if self.zoom[1] > 1:
            raise UserError(f"data.variation.zoom only shrinks, to at most 1; got {list(self.zoom)}")

    def draw(self, dice: np.random.Generator) -> tuple[float, float]:
        """(zoom, exposure); a range of one value draws nothing, so that other draws stay as they are without it."""
        zoom, exposure = (
            low if low == high else math.exp(dice.uniform(math.log(low), math.log(high)))
            for low, high in (self.zoom, self.exposure)
        )
        return zoom, exposure


def shrink_around(levels: np.ndarray, top: int, left: int, side: int, zoom: float) -> np.ndarray:
    """A window of the shrunk picture, (side, side, 3) uint8, that starts near (top, left) of `levels` (H, W, 3).

    It is moved inwards where it would leave the picture; a picture that is too small for it is shrunk less.
    """
    height, width = levels.shape[:2]
    reach = min(round(side / zoom), height, width)
    top, left = min(top, height - reach), min(left, width - reach)
    return to_uint8(resize(from_uint8(levels[top : top + reach, left : left + reach]), (side, side)))


def expose(levels: np.ndarray, exponent: float) -> np.ndarray:
    """The picture with another exposure, (levels / 255)^exponent; uint8 -> uint8."""
    curve = (255 * np.linspace(0, 1, 256) ** exponent).round().astype(np.uint8)
    return curve[levels]
