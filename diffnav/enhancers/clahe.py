"""Contrast-limited adaptive histogram equalisation (Zuiderveld 1994) of the lightness, by OpenCV."""

from collections.abc import Sequence
from typing import Literal

import cv2
import numpy as np
import torch
from torch import Tensor, nn

from diffnav.darkness import Darkening
from diffnav.errors import UserError


class Clahe(nn.Module):
    """CLAHE on one lightness channel: (B, 3, H, W) in [0, 1] -> the same; computed on the CPU.

    clip_limit: bound on a histogram bin, as a multiple of the flat histogram's. grid: tiles per side.
    channel: "L" equalises CIELAB's lightness and keeps a and b; "V" equalises max(R, G, B) and scales the colour
    with it, so hue and saturation stay. The channel has 256 levels while it is equalised.
    """

    def __init__(self, clip_limit: float = 10.0, grid: int = 8, channel: Literal["L", "V"] = "L") -> None:
        super().__init__()
        if clip_limit <= 0 or grid < 1 or channel not in ("L", "V"):
            raise UserError(
                "clahe needs clip_limit above 0, grid of 1 or more and channel L or V; "
                f"got {clip_limit}, {grid}, {channel}"
            )
        self.clip_limit = clip_limit
        self.grid = grid
        self.channel = channel

    def forward(self, image: Tensor, record: Sequence[Darkening] | None = None) -> Tensor:  # noqa: ARG002
        return torch.stack([self._one(one) for one in image.detach().float().cpu()]).to(image)

    def _one(self, image: Tensor) -> Tensor:
        rgb = np.ascontiguousarray(image.permute(1, 2, 0).numpy())
        if self.channel == "L":
            # Float CIELAB: 8 bit would leave a dark picture a handful of colours.
            lab = cv2.cvtColor(rgb, cv2.COLOR_RGB2LAB)
            lab[..., 0] = 100 * self._equalise(lab[..., 0] / 100)
            result = cv2.cvtColor(lab, cv2.COLOR_LAB2RGB)
        else:
            value = rgb.max(2)
            gain = self._equalise(value) / np.maximum(value, 1 / 255)
            result = rgb * gain[..., None]
        return torch.from_numpy(np.ascontiguousarray(result.transpose(2, 0, 1))).clamp(0, 1)

    def _equalise(self, lightness: np.ndarray) -> np.ndarray:
        levels = (lightness.clip(0, 1) * 255).round().astype(np.uint8)
        clahe = cv2.createCLAHE(clipLimit=self.clip_limit, tileGridSize=(self.grid, self.grid))
        return clahe.apply(levels).astype(np.float32) / 255
