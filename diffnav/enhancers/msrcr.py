"""MSRCR (Jobson, Rahman and Woodell 1997): multiscale Retinex with colour restoration."""

import math
from collections.abc import Sequence
from typing import Literal

import torch
from torch import Tensor, nn

from diffnav.darkness import Darkening
from diffnav.errors import UserError

# A channel whose two ends lie closer than this (of several hundred; a step of 8 bit is .6 and more) has no contrast.
_FLAT = 0.1
# Frequencies that a Gaussian weakens below this are left out.
_RESPONSE = 1e-7


class Msrcr(nn.Module):
    """Logarithms of the ratios to three Gaussian surrounds, times colour restoration: (B, 3, H, W) in [0, 1] -> same.

    sigmas: of the surrounds, pixels. alpha, beta: of the colour restoration beta (log(alpha S_c) - log sum_c S_c).
    finish: "stretch" takes each channel linearly from its `clip` to its 1 - `clip` quantile, as public codes do
    (a channel without contrast stays as it was); "gain" is gain (value + offset) on 0..255 with natural logarithms,
    the constants as printed, which leave little but black and white.
    """

    def __init__(
        self,
        sigmas: Sequence[float] = (15.0, 80.0, 250.0),
        alpha: float = 125.0,
        beta: float = 46.0,
        finish: Literal["stretch", "gain"] = "stretch",
        clip: float = 0.01,
        gain: float = 192.0,
        offset: float = -30.0,
    ) -> None:
        super().__init__()
        if len(sigmas) == 0 or min(sigmas) < 1 or alpha <= 0 or beta <= 0:
            raise UserError(
                "msrcr needs one or more sigmas of 1 pixel or more, alpha and beta above 0; "
                f"got {list(sigmas)}, {alpha}, {beta}"
            )
        if finish not in ("stretch", "gain") or not 0 <= clip < 0.5 or gain <= 0:
            raise UserError(
                "msrcr needs finish stretch or gain, clip from 0 to below .5 and gain above 0; "
                f"got {finish}, {clip}, {gain}"
            )
        self.sigmas = tuple(sigmas)
        self.alpha = alpha
        self.beta = beta
        self.finish = finish
        self.clip = clip
        self.gain = gain
        self.offset = offset

    def forward(self, image: Tensor, record: Sequence[Darkening] | None = None) -> Tensor:  # noqa: ARG002
        value = self.restored(image)
        if self.finish == "gain":
            return (self.gain * (value + self.offset) / 255).clamp(0, 1)
        return stretch(value, image, self.clip)

    def restored(self, image: Tensor) -> Tensor:
        """The multiscale Retinex times the colour restoration, before any stretch or gain: (B, 3, H, W)."""
        # On 1..256 no logarithm meets a zero.
        levels = 255 * image + 1
        surrounds = sum(gaussian_blur(levels, sigma).clamp(min=1).log() for sigma in self.sigmas)
        retinex = levels.log() - surrounds / len(self.sigmas)
        restoration = self.beta * ((self.alpha * levels).log() - levels.sum(1, keepdim=True).log())
        return retinex * restoration


def stretch(value: Tensor, image: Tensor, clip: float) -> Tensor:
    """Each channel of value (B, 3, H, W) linearly from its quantiles clip and 1 - clip to [0, 1], cut beyond them.

    A channel between whose quantiles there is nothing to stretch is that of `image`.
    """
    flat = value.flatten(2)
    left_out = int(clip * (flat.shape[2] - 1))
    low = flat.kthvalue(1 + left_out, dim=2).values[..., None, None]
    high = flat.kthvalue(flat.shape[2] - left_out, dim=2).values[..., None, None]
    spread = high - low
    return torch.where(spread > _FLAT, (value - low) / spread.clamp(min=_FLAT), image).clamp(0, 1)


def gaussian_blur(image: Tensor, sigma: float) -> Tensor:
    """(..., H, W) convolved with a Gaussian of sigma pixels, the picture mirrored at its borders without end.

    A mirrored picture is a sum of cosines, each of which a Gaussian only weakens: the few that it leaves (5 of 600
    at sigma 250) give the convolution to about 1e-6 of the picture's range, however wide the Gaussian.
    """
    rows, row_responses = _cosines(image.shape[-2], sigma, image)
    columns, column_responses = _cosines(image.shape[-1], sigma, image)
    spectrum = rows @ image @ columns.T
    return rows.T @ (row_responses[:, None] * spectrum * column_responses) @ columns


def _cosines(length: int, sigma: float, like: Tensor) -> tuple[Tensor, Tensor]:
    """The orthonormal cosines over `length` pixels (DCT-II) that a Gaussian leaves, (K, length), and how much, (K,)."""
    most = math.sqrt(-2 * math.log(_RESPONSE)) * length / (math.pi * sigma)
    k = torch.arange(min(length, math.floor(most) + 1), dtype=torch.float64)[:, None]
    x = torch.arange(length, dtype=torch.float64) + 0.5
    basis = torch.cos(math.pi * k * x / length) * math.sqrt(2 / length)
    basis[0] /= math.sqrt(2)
    response = torch.exp(-0.5 * (math.pi * sigma * k[:, 0] / length) ** 2)
    return basis.to(like), response.to(like)
