"""MF (Fu et al. 2016): three versions of the illumination, fused by pyramids."""

from collections.abc import Sequence
from functools import partial

import cv2
import numpy as np
import torch
from torch import Tensor, nn

from diffnav.darkness import Darkening
from diffnav.enhancers.windows import window_mean
from diffnav.errors import UserError

# What the illumination is divided by is at least one grey level: the guided filter leaves values around 0.
_SMALLEST_ILLUMINATION = 1 / 255


class Mf(nn.Module):
    """R times the fused illumination, R = S / I: (B, 3, H, W) in [0, 1] -> the same; computed on the CPU.

    disc: radius of the closing, pixels. radius, eps: the guided filter's, pixels and squared values of the guide.
    clip_limit, grid: CLAHE's, of I3. levels: of the pyramids, the picture itself counted.
    Source: Fu et al., "A fusion-based enhancing method for weakly illuminated images", Signal Processing 2016;
    PAPER 9.
    """

    def __init__(
        self,
        disc: int = 7,
        radius: int = 2,
        eps: float = 0.004,
        clip_limit: float = 3.0,
        grid: int = 8,
        levels: int = 3,
    ) -> None:
        super().__init__()
        if min(disc, radius) < 0 or min(eps, clip_limit) <= 0 or min(grid, levels) < 1:
            raise UserError(
                "mf needs disc and radius of 0 or more, eps and clip_limit above 0, grid and levels of 1 or more; "
                f"got {disc}, {radius}, {eps}, {clip_limit}, {grid}, {levels}"
            )
        self.disc = disc
        self.radius = radius
        self.eps = eps
        self.clip_limit = clip_limit
        self.grid = grid
        self.levels = levels

    def forward(self, image: Tensor, record: Sequence[Darkening] | None = None) -> Tensor:  # noqa: ARG002
        return torch.stack([self._one(one) for one in image.detach().float().cpu()]).to(image)

    def _one(self, image: Tensor) -> Tensor:
        L = image.amax(0).numpy()
        guide = L / max(L.max(), _SMALLEST_ILLUMINATION)
        I = guided_filter(guide, close_with_disc(L, self.disc), self.radius, self.eps)
        I = I.clip(_SMALLEST_ILLUMINATION)
        versions = [I, stretch(I), self._equalise(I)]
        fused = fuse(versions, weights(versions), self.levels)
        return (image * torch.from_numpy(fused / I)).clamp(0, 1)

    def _equalise(self, I: np.ndarray) -> np.ndarray:
        clahe = cv2.createCLAHE(clipLimit=self.clip_limit, tileGridSize=(self.grid, self.grid))
        return clahe.apply((255 * I).round().clip(0, 255).astype(np.uint8)).astype(np.float32) / 255


def close_with_disc(image: np.ndarray, radius: int) -> np.ndarray:
    """Grey closing: dark spots into which no disc of this radius (pixels) fits are filled: (H, W) -> the same."""
    offsets = np.arange(-radius, radius + 1)
    disc = offsets[:, None] ** 2 + offsets**2 <= radius**2
    return cv2.morphologyEx(image, cv2.MORPH_CLOSE, disc.astype(np.uint8))


def guided_filter(guide: np.ndarray, image: np.ndarray, radius: int, eps: float) -> np.ndarray:
    """The image as locally a straight function of the guide: (H, W) -> the same. Source: He et al. 2013.

    Means are over windows of 2 radius + 1 pixels, cut off at the border.
    """
    mean = partial(window_mean, size=(2 * radius + 1, 2 * radius + 1))
    mean_guide, mean_image = mean(guide), mean(image)
    variance = mean(guide * guide) - mean_guide**2
    slope = (mean(guide * image) - mean_guide * mean_image) / (variance + eps)
    return mean(slope) * guide + mean(mean_image - slope * mean_guide)


def stretch(I: np.ndarray) -> np.ndarray:
    """I2 = (2 / pi) atan(k I), k = 10 + (1 - mean I) / mean I: the darker the picture, the steeper; mean I above 0."""
    mean = I.mean()
    return np.float32(2 / np.pi) * np.arctan((10 + (1 - mean) / mean) * I)


def weights(versions: Sequence[np.ndarray]) -> list[np.ndarray]:
    """W_k = B_k C_k, normalised over k; (H, W) each, above 0.

    B_k favours medium brightness; of C_k = I_k (1 + cos(2 H + 250 deg) Sat) only I_k is left: hue and saturation are
    the picture's, the same in all versions, and cancel.
    """
    raw = [np.exp(-((version - 0.5) ** 2) / (2 * 0.25**2)) * version for version in versions]
    total = sum(raw)
    return [one / total for one in raw]


def fuse(versions: Sequence[np.ndarray], weights: Sequence[np.ndarray], levels: int) -> np.ndarray:
    """The sum of the versions' Laplacian pyramids times the weights' Gaussian pyramids, put together: (H, W)."""
    details: list[np.ndarray] = []
    for _ in range(levels - 1):
        smaller = [cv2.pyrDown(version) for version in versions]
        bands = [fine - _enlarge(coarse, fine) for fine, coarse in zip(versions, smaller, strict=True)]
        details.append(sum(w * band for w, band in zip(weights, bands, strict=True)))
        versions, weights = smaller, [cv2.pyrDown(weight) for weight in weights]
    result = sum(w * version for w, version in zip(weights, versions, strict=True))
    for detail in reversed(details):
        result = detail + _enlarge(result, detail)
    return result


def _enlarge(coarse: np.ndarray, like: np.ndarray) -> np.ndarray:
    return cv2.pyrUp(coarse, dstsize=(like.shape[1], like.shape[0]))
