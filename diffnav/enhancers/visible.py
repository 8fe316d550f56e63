"""What eight bits of the dark picture leave to be seen: daylight where Eq. 9 spares some levels, flat elsewhere."""

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from diffnav.darkness import Darkening, apply_gamma
from diffnav.enhancers.normal import daylight_of
from diffnav.errors import UserError


class Visible(nn.Module):
    """An estimate of what a perfect restoration could show: (B, 3, H, W) in [0, 1] -> the same shape.

    Values that Eq. 9 darkens to at most `levels` of 255 are replaced by their mean, channel by channel; all others are
    daylight itself, without noise. Not a strict bound: neighbourhoods of few levels still tell something, and what
    lies above them is noisy in truth. Raises: UserError if a record, or the picture in it, is missing.
    """

    needs_record = True

    def __init__(self, levels: int = 2) -> None:
        super().__init__()
        if not 0 <= levels < 255:
            raise UserError(f"visible needs levels from 0 to 254, got {levels}")
        self.levels = levels

    def forward(self, image: Tensor, record: Sequence[Darkening] | None = None) -> Tensor:
        normal = daylight_of(image, record, "visible")
        assert record is not None
        dark = torch.stack([apply_gamma(one, r) for one, r in zip(normal, record, strict=True)])
        lost = (dark * 255).round() <= self.levels
        count = lost.sum((2, 3), keepdim=True).clamp(min=1)
        mean = (normal * lost).sum((2, 3), keepdim=True) / count
        return torch.where(lost, mean, normal)
