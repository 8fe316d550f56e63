"""What a camera makes of a view in daylight: blur, colour shift, noise, 8 bit, JPEG; seeded and recorded.

What it takes is drawn once from a seed (`Camera.draw`) into a `Capture`; `photograph` applies it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from diffnav.blur import blur
from diffnav.errors import UserError
from diffnav.images import from_uint8, jpeg_round_trip, quantise, to_uint8

Range = tuple[float, float]
Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Capture:
    """The record of one picture taken.

    blur_px: standard deviation of the lens's Gaussian, 0 for none. gain, offset: of R, G, B, on [0, 1]. noise: its
    standard deviation on [0, 1]. seed: the noise's. quality: JPEG quality 1 to 100, 0 for none.
    """

    blur_px: float = 0.0
    gain: Colour = (1.0, 1.0, 1.0)
    offset: Colour = (0.0, 0.0, 0.0)
    noise: float = 0.0
    seed: int = 0
    quality: int = 95


@dataclass(frozen=True)
class Camera:
    """The distribution that captures are drawn from, each number evenly.

    blur_px: (low, high) of the blur's standard deviation, at most 5 pixels. gain: each channel's factor is drawn from
    1 +- gain, at most 0.9. offset: each channel's shift is drawn from +- offset, at most 0.5 of full scale. noise:
    (low, high) of the white noise's standard deviation, at most 0.5 of full scale. quality: JPEG quality, 0 for none.

    Raises: UserError if one of them is out of its range.
    """

    blur_px: Range = (0.0, 0.8)
    gain: float = 0.1
    offset: float = 0.03
    noise: Range = (0.004, 0.012)
    quality: int = 95

    def __post_init__(self) -> None:
        object.__setattr__(self, "blur_px", checked_range("query_set.camera.blur_px", self.blur_px, 0, 5))
        object.__setattr__(self, "noise", checked_range("query_set.camera.noise", self.noise, 0, 0.5))
        for name, most in (("gain", 0.9), ("offset", 0.5), ("quality", 100)):
            value = getattr(self, name)
            if not isinstance(value, int | float) or not 0 <= value <= most:
                raise UserError(f"query_set.camera.{name} must be a number from 0 to {most}, got {value}")
        if self.quality != int(self.quality):
            raise UserError(f"query_set.camera.quality must be a whole number, got {self.quality}")

    def draw(self, seed: int) -> Capture:
        """A pure function of `seed`."""
        dice = np.random.default_rng(seed)
        blur_px, noise = (float(dice.uniform(*bounds)) for bounds in (self.blur_px, self.noise))
        gain, offset = (
            _colour(dice.uniform(middle - reach, middle + reach, 3))
            for middle, reach in ((1.0, self.gain), (0.0, self.offset))
        )
        return Capture(blur_px, gain, offset, noise, seed, int(self.quality))


def photograph(view: Tensor, capture: Capture) -> Tensor:
    """The picture that a camera stores of a view: (3, H, W) in [0, 1] -> the same, 8 bit.

    As light travels: lens blur, colour shift (gain I + offset, no change of gamma), white noise, 8 bit, JPEG.
    """
    if capture.blur_px > 0:
        view = blur(view[None], capture.blur_px)[0]
    picture = view * _column(capture.gain) + _column(capture.offset)
    if capture.noise > 0:
        dice = torch.Generator().manual_seed(capture.seed)
        picture = picture + capture.noise * torch.randn(picture.shape, generator=dice)
    if capture.quality == 0:
        return quantise(picture)
    return from_uint8(jpeg_round_trip(to_uint8(picture), capture.quality))


def checked_range(name: str, values: Sequence[float], least: float, most: float) -> Range:
    """(low, high) as a tuple. Raises: UserError, naming it, if it is not two numbers in order within least and most."""
    try:
        low, high = values
        fits = least <= low <= high <= most
    except (TypeError, ValueError):
        fits = False
    if not fits:
        raise UserError(f"{name} must be two numbers, low and high, from {least} to {most}; got {values}")
    return float(low), float(high)


def _colour(values: np.ndarray) -> Colour:
    red, green, blue = values.tolist()
    return red, green, blue


def _column(values: Colour) -> Tensor:
    return torch.tensor(values)[:, None, None]
