"""NPE (Wang et al. 2013): the illumination by a bright-pass filter, mapped by the bi-log transformation."""

from collections.abc import Sequence

import cv2
import numpy as np
import torch
from torch import Tensor, nn

from diffnav.darkness import Darkening
from diffnav.enhancers.windows import window_mean, window_sum
from diffnav.errors import UserError

_LEVELS = np.arange(256)
# Of the largest weight; a sum below it is what is left of rounding, no pixel at all.
_NO_WEIGHT = 1e-8


class Npe(nn.Module):
    """R_c times the mapped illumination, R_c = S_c / L_r: (B, 3, H, W) in [0, 1] -> the same; computed on the CPU.

    window: side of the bright-pass filter, pixels. span: grey levels over which Q(a, b) is averaged around b; even.
    Source: Wang et al., "Naturalness preserved enhancement algorithm for non-uniform illumination images",
    IEEE TIP 2013; PAPER 9.
    """

    def __init__(self, window: int = 15, span: int = 8) -> None:
        super().__init__()
        if window < 1 or window % 2 == 0 or not 0 <= span < 256 or span % 2:
            raise UserError(
                f"npe needs an odd window of 1 or more and an even span from 0 to 254; got {window}, {span}"
            )
        self.window = window
        self.span = span

    def forward(self, image: Tensor, record: Sequence[Darkening] | None = None) -> Tensor:  # noqa: ARG002
        return torch.stack([self._one(one) for one in image.detach().float().cpu()]).to(image)

    def _one(self, image: Tensor) -> Tensor:
        L = 255 * image.amax(0).numpy()
        levels = L.clip(0, 255).round().astype(np.uint8)
        L_r = bright_pass(levels, neighbour_counts(levels, self.span), self.window)
        # Only what is finer than 8 bit can lie above L_r; black divided by black is black.
        gain = bilog(L_r) / np.maximum(L_r, L).clip(min=1e-6)
        return (image * torch.from_numpy(gain.astype(np.float32))).clamp(0, 1)


def neighbour_counts(levels: np.ndarray, span: int) -> np.ndarray:
    """Q(a, b): how often level b is one of the eight neighbours of level a, averaged over the levels around b.

    levels: (H, W) uint8. span: the average is taken from b - span / 2 to b + span / 2, within 0 to 255.
    Returns: (256, 256) float32, rows a.
    """
    codes = levels.astype(np.uint16)
    pairs = [
        (codes[:, :-1], codes[:, 1:]),
        (codes[:-1], codes[1:]),
        (codes[:-1, :-1], codes[1:, 1:]),
        (codes[:-1, 1:], codes[1:, :-1]),
    ]
    once = np.zeros(256 * 256, np.int64)
    for a, b in pairs:
        once += np.bincount((256 * a + b).ravel(), minlength=256 * 256)
    counts = once.reshape(256, 256) + once.reshape(256, 256).T
    return window_mean(counts.astype(np.float32), (1, span + 1))


def bright_pass(levels: np.ndarray, Q: np.ndarray, window: int) -> np.ndarray:
    """L_r, the mean of the pixels around that are at least as bright, weighted by Q: (H, W) float32 in [0, 255].

    L_r(p) = sum Q(L(p), L(q)) u L(q) / sum Q(L(p), L(q)) u over q in the window, u = 1 where L(q) >= L(p); L(p)
    where all weights are 0, never below it. levels: (H, W) uint8.

    For all pixels of one level the weights are one table, so that the sums are a box filter of the picture looked up
    in it: as many filters as there are levels, whatever the window.
    """
    order = np.argsort(levels, axis=None, kind="stable")
    starts = np.searchsorted(levels.ravel()[order], np.arange(257))
    twice = cv2.merge([levels, levels])
    result = np.empty(levels.size, np.float32)
    for level in np.unique(levels).tolist():
        weights = np.where(level <= _LEVELS, Q[level], 0)
        weights /= max(weights.max(), _NO_WEIGHT)
        table = np.stack([weights, weights * _LEVELS], axis=1).astype(np.float32)[None]
        sums = window_sum(cv2.LUT(twice, table), (window, window))
        places = order[starts[level] : starts[level + 1]]
        total, weighted = sums.reshape(-1, 2)[places].T
        result[places] = np.where(total > _NO_WEIGHT, weighted / total.clip(_NO_WEIGHT), level)
    return result.reshape(levels.shape).clip(levels, 255)


def bilog(L_r: np.ndarray) -> np.ndarray:
    """L_m = F^-1(C(L_r)), the illumination whose histogram follows the logarithm: (H, W) in [0, 255] -> the same.

    C: the histogram of L_r, each level z weighted by log(z + 1), summed up; F: log(z + 1) summed up; both end at 1.
    Between whole levels both are straight, so that the mapping has no steps; it grows with L_r.
    """
    logarithm = np.log(_LEVELS + 1.0)
    C = np.cumsum(logarithm * np.bincount(L_r.round().astype(np.int64).ravel(), minlength=256))
    F = np.cumsum(logarithm)
    # A black picture has no weight at all: C = 0 there, and F^-1(0) = 0.
    mapped = np.interp(C / max(C[-1], 1e-6), F / F[-1], _LEVELS)
    return np.interp(L_r, _LEVELS, mapped)
