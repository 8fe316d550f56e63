"""Dong et al. 2011: a dark picture turned into its negative looks hazy, so it is dehazed and turned back."""

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from diffnav.darkness import Darkening
from diffnav.errors import UserError

# The negative is continued by this many pixels before its haze is measured, as the public port does.
_PADDING_PX = 10
# A white picture has the negative 0 and so the light 0, which D is divided by.
_SMALLEST_LIGHT = 1e-6
_SMALLEST_TRANSMISSION = 1e-7


class Dong(nn.Module):
    """1 - J, where J = (Q - A) / t + A is the dehazed negative Q: (B, 3, H, W) in [0, 1] -> the same.

    strength: share of the haze that is taken away. window: side of the minimum filter D, pixels. share: of all
    pixels, those with the largest D, among which the brightest is the haze's light A.
    Source: Dong et al., "Fast efficient algorithm for enhancement of low lighting video", ICME 2011; PAPER 9.
    """

    def __init__(self, strength: float = 0.8, window: int = 7, share: float = 0.002) -> None:
        super().__init__()
        if not 0 < strength <= 1 or window < 1 or window % 2 == 0 or not 0 < share <= 1:
            raise UserError(
                "dong needs strength and share above 0 and at most 1, and an odd window of 1 or more; "
                f"got {strength}, {share}, {window}"
            )
        self.strength = strength
        self.window = window
        self.share = share

    def forward(self, image: Tensor, record: Sequence[Darkening] | None = None) -> Tensor:  # noqa: ARG002
        Q = F.pad(1 - image, [_PADDING_PX] * 4, mode="replicate")
        D = minimum_filter(Q, self.window)
        A = haze_light(Q, D, self.share)
        J = (Q - A) / transmission(D, A, self.strength) + A
        inside = slice(_PADDING_PX, -_PADDING_PX)
        return (1 - J[..., inside, inside]).clamp(0, 1)


def minimum_filter(image: Tensor, window: int) -> Tensor:
    """The smallest value in the window around each pixel, each channel apart: (B, C, H, W) -> the same shape."""
    rows = F.max_pool2d(-image, (window, 1), 1, (window // 2, 0))
    return -F.max_pool2d(rows, (1, window), 1, (0, window // 2))


def haze_light(Q: Tensor, D: Tensor, share: float) -> Tensor:
    """A, the colour with the largest mean of R, G, B where D's smallest channel is largest: (B, 3, 1, 1).

    Q, D: (B, 3, H, W), a hazy picture and its minimum filter. Of H W pixels `share`, at least one, takes part, and
    whatever ties with the last of them: dark pictures of 8 bit have many equal values, whose order means nothing.
    """
    dark = D.amin(1).flatten(1)
    count = max(1, int(share * dark.shape[1]))
    least = dark.topk(count).values[:, -1:]
    brightness = Q.mean(1).flatten(1).masked_fill(dark < least, -torch.inf)
    place = brightness.argmax(1)[:, None, None].expand(-1, 3, 1)
    return Q.flatten(2).gather(2, place)[..., None]


def transmission(D: Tensor, A: Tensor, strength: float) -> Tensor:
    """t = 1 - strength min_c(D_c / A_c), above 0, and 2 t^2 where that is below .5: (B, 1, H, W)."""
    t = 1 - strength * (D / A.clamp(min=_SMALLEST_LIGHT)).amin(1, keepdim=True)
    t = t.clamp(min=_SMALLEST_TRANSMISSION)
    return torch.where(t < 0.5, 2 * t.square(), t)
