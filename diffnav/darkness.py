"""Synthetic darkness: Eq. 9 of the paper, and beyond it blur, colour cast and sensor noise.

A darkening is drawn once from a seed (`DarknessModel.draw`) into a `Darkening`, the record that holds every
number needed to repeat or to invert it; `darken` applies a record. Order, as light travels: motion blur,
colour cast, Eq. 9, shot and read noise, 8 bit, JPEG.
"""

import math
from dataclasses import asdict, dataclass, field

import cv2
import numpy as np
import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.images import from_uint8, jpeg_round_trip, quantise, to_uint8

Range = tuple[float, float]


@dataclass(frozen=True)
class Darkening:
    """The record of one darkening.

    gamma: exponent of Eq. 9. maximum: M, the daylight image's largest value over all channels, in [0, 1].
    quality: JPEG quality 1-100, 0 for none. seed: the noise's. shot, read: noise variance is shot^2 I + read^2.
    blur_px, blur_deg: pixels that the motion blur covers (1: none) and its direction, from x towards y (down).
    cast: gains of R, G, B. normal: the daylight image, kept for the `normal` enhancer, not part of the record.
    """

    gamma: float
    maximum: float
    quality: int = 95
    seed: int = 0
    shot: float = 0.0
    read: float = 0.0
    blur_px: float = 1.0
    blur_deg: float = 0.0
    cast: tuple[float, float, float] = (1.0, 1.0, 1.0)
    normal: Tensor | None = field(default=None, repr=False, compare=False)

    @property
    def A(self) -> float:
        """The constant of Eq. 9, M^(1 - gamma): the brightest value stays (D14); 0 for a black image."""
        return self.maximum ** (1 - self.gamma) if self.maximum > 0 else 0.0

    def numbers(self) -> dict:
        """All fields but the image, with A, for a manifest."""
        record = asdict(Darkening(**{**self.__dict__, "normal": None}))
        del record["normal"]
        return {**record, "A": self.A}


@dataclass(frozen=True)
class DarknessModel:
    """The distribution that darkenings are drawn from; every range is (low, high), drawn uniformly.

    gamma: U(3, 5) in the paper. quality: JPEG quality, whole numbers. shot, read: noise, on [0, 1]. blur_px:
    length of the motion blur in pixels. cast: each channel's gain is drawn from 1 +- cast.

    Raises: UserError if a range is not two numbers in order, or lies outside its limits.
    """

    gamma: Range = (3.0, 5.0)
    quality: tuple[int, int] = (95, 95)
    shot: Range = (0.0, 0.0)
    read: Range = (0.0, 0.0)
    blur_px: Range = (1.0, 1.0)
    cast: float = 0.0

    def __post_init__(self) -> None:
        for name in ("gamma", "quality", "shot", "read", "blur_px"):
            object.__setattr__(self, name, _range(name, getattr(self, name)))
        if self.gamma[0] <= 0:
            raise UserError(f"darkness.gamma must be above 0; got {list(self.gamma)}")
        if self.quality[1] > 100 or any(value != int(value) for value in self.quality):
            raise UserError(f"darkness.quality must be whole, 1 to 100, or 0 for none; got {list(self.quality)}")
        if not isinstance(self.cast, int | float) or not 0 <= self.cast < 1:
            raise UserError(f"darkness.cast must be a number from 0 to below 1; got {self.cast}")

    def draw(self, maximum: float, seed: int) -> Darkening:
        """The darkening of an image with this maximum, a pure function of `seed`.

        gamma is drawn first and alone decides Eq. 9, so models that differ in noise share their gammas.
        """
        dice = np.random.default_rng(seed)
        gamma, shot, read, blur_px = (
            float(dice.uniform(*bounds)) for bounds in (self.gamma, self.shot, self.read, self.blur_px)
        )
        low, high = (int(value) for value in self.quality)
        quality = int(dice.integers(low, high + 1))
        blur_deg = float(dice.uniform(0, 180))
        red, green, blue = (float(gain) for gain in dice.uniform(1 - self.cast, 1 + self.cast, 3))
        return Darkening(
            gamma=gamma,
            maximum=float(maximum),
            quality=quality,
            seed=seed,
            shot=shot,
            read=read,
            blur_px=max(blur_px, 1.0),
            blur_deg=blur_deg,
            cast=(red, green, blue),
        )


def _range(name: str, values: Range) -> Range:
    """(low, high) as a tuple. Raises: UserError if it is anything but two numbers in order, from 0 on."""
    try:
        low, high = values
        fits = 0 <= low <= high < math.inf
    except (TypeError, ValueError):
        fits = False
    if not fits:
        raise UserError(f"darkness.{name} must be two numbers, low and high, not below 0; got {values}")
    return low, high


def darken(image: Tensor, record: Darkening) -> Tensor:
    """The dark image that `record` describes, through 8 bit and JPEG: (3, H, W) in [0, 1] -> the same.

    Source: Eq. 9 with A = M^(1 - gamma); the rest goes beyond the paper.
    """
    dark = expose(image, record)
    if record.quality == 0:
        return quantise(dark)
    return from_uint8(jpeg_round_trip(to_uint8(dark), record.quality))


def expose(image: Tensor, record: Darkening) -> Tensor:
    """The dark image before it is stored: (3, H, W) in [0, 1] -> the same, noise reaching a little further."""
    dark = apply_gamma(_cast(_motion_blur(image, record.blur_px, record.blur_deg), record.cast), record)
    return _add_noise(dark, record)


def apply_gamma(image: Tensor, record: Darkening) -> Tensor:
    """Eq. 9, M (I / M)^gamma, on [0, 1]; a black image (M = 0) stays black."""
    if record.maximum <= 0:
        return torch.zeros_like(image)
    return record.maximum * (image / record.maximum).clamp(min=0) ** record.gamma


def invert_gamma(dark: Tensor, gamma: float, maximum: float = 1.0) -> Tensor:
    """Eq. 9 inverted, M (I_low / M)^(1 / gamma), clipped to [0, 1]; black where M = 0."""
    if maximum <= 0:
        return torch.zeros_like(dark)
    return (maximum * (dark / maximum).clamp(min=0) ** (1 / gamma)).clamp(0, 1)


def _cast(image: Tensor, gains: tuple[float, float, float]) -> Tensor:
    if gains == (1.0, 1.0, 1.0):
        return image
    return (image * image.new_tensor(gains)[:, None, None]).clamp(0, 1)


def _add_noise(image: Tensor, record: Darkening) -> Tensor:
    """Heteroscedastic Gaussian noise: variance shot^2 I + read^2, the usual model of a linear sensor."""
    if record.shot == 0 and record.read == 0:
        return image
    dice = torch.Generator().manual_seed(record.seed)
    deviation = (record.shot**2 * image + record.read**2).sqrt()
    return image + deviation * torch.randn(image.shape, generator=dice)


def _motion_blur(image: Tensor, length_px: float, direction_deg: float) -> Tensor:
    """Average along a straight line that covers `length_px` pixels, the border replicated; 1 px changes nothing.

    It is the path of length_px - 1 between the first and the last pixel's centre: long exposure in level flight.
    """
    if length_px <= 1:
        return image
    radius = math.ceil(length_px / 2)
    samples = 16 * radius
    offsets = ((torch.arange(samples, dtype=torch.float64) + 0.5) / samples - 0.5) * (length_px - 1)
    x = radius + offsets * math.cos(math.radians(direction_deg))
    y = radius + offsets * math.sin(math.radians(direction_deg))
    kernel = np.zeros((2 * radius + 2, 2 * radius + 2))
    for dy in (0, 1):
        for dx in (0, 1):
            # Bilinear splat of each sample of the line.
            weight = (1 - (x - (x.floor() + dx)).abs()) * (1 - (y - (y.floor() + dy)).abs())
            np.add.at(kernel, (y.floor().long() + dy, x.floor().long() + dx), weight.clamp(min=0).numpy())
    kernel = kernel[:-1, :-1] / kernel[:-1, :-1].sum()
    blurred = cv2.filter2D(image.permute(1, 2, 0).numpy(), -1, kernel, borderType=cv2.BORDER_REPLICATE)
    return torch.from_numpy(blurred).permute(2, 0, 1).clamp(0, 1).contiguous()
