"""Eq. 9 inverted with the gamma and the maximum that darkened the image: what no blind inversion can beat."""

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from diffnav.darkness import Darkening, invert_gamma
from diffnav.enhancers.records import require_records


class GammaOracle(nn.Module):
    """M (x / M)^(1 / gamma) with each image's recorded gamma and M: (B, 3, H, W) in [0, 1] -> the same.

    Noise, blur and colour cast stay: only Eq. 9 is inverted. Raises: UserError if a record is missing.
    """

    needs_record = True

    def forward(self, image: Tensor, record: Sequence[Darkening] | None = None) -> Tensor:
        records = require_records(image, record, "gamma_oracle")
        return torch.stack(
            [invert_gamma(dark, one.gamma, one.maximum) for dark, one in zip(image, records, strict=True)]
        )
