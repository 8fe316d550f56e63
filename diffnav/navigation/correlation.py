"""Dense correlation of gradient directions: finds a picture of known heading and scale in a map of another season."""

from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn.functional import avg_pool2d, max_pool2d

from diffnav.blur import blur

# Half of the window in which gradients are made equally strong, pixels.
_LOCAL_PX = 8
# A gradient weaker than this is noise, in the grey levels of [0, 1] per pixel.
_NOISE = 2e-3


class Peak(NamedTuple):
    """Where a template fits best: x, y of its first pixel in the picture; score in [-1, 1]; that of the best rival."""

    x: float
    y: float
    score: float
    rival: float


def direction_field(image: Tensor, sigma: float = 1.5) -> Tensor:
    """Directions of the edges of a picture (3, H, W) as vectors (2, H, W) of about equal length.

    An edge at angle t becomes (cos 2t, sin 2t): dark to bright and bright to dark, which seasons exchange, are one. It
    is as long as its gradient over the mean gradient around it, cut at 2. Args: sigma: of the blur before, pixels.
    """
    grey = blur((image * image.new_tensor([0.299, 0.587, 0.114])[:, None, None]).sum(0)[None, None], sigma)
    dx, dy = torch.zeros_like(grey), torch.zeros_like(grey)
    dx[..., 1:-1] = (grey[..., 2:] - grey[..., :-2]) / 2
    dy[..., 1:-1, :] = (grey[..., 2:, :] - grey[..., :-2, :]) / 2
    strength = (dx.square() + dy.square()).sqrt()
    side = 2 * _LOCAL_PX + 1
    # Along columns, then along rows: the same mean, eight times as fast.
    around = avg_pool2d(strength, (side, 1), 1, (_LOCAL_PX, 0), count_include_pad=False)
    around = avg_pool2d(around, (1, side), 1, (0, _LOCAL_PX), count_include_pad=False)
    length = (strength / (around + _NOISE)).clamp(max=2)
    square = strength.square().clamp(min=1e-12)
    return torch.cat([(dx.square() - dy.square()) / square, 2 * dx * dy / square], 1)[0] * length[0]


class Searched:
    """A picture (C, H, W) in which templates are searched for, one after the other."""

    def __init__(self, picture: Tensor) -> None:
        self.size = (picture.shape[1], picture.shape[2])
        # What wraps around in between stays outside of the places that count.
        self._fast_size = (_fast_length(self.size[0]), _fast_length(self.size[1]))
        self._values = torch.fft.rfft2(picture, s=self._fast_size)
        self._energy = torch.fft.rfft2(picture.square().sum(0), s=self._fast_size)

    def scores(self, template: Tensor, mask: Tensor) -> Tensor:
        """How well a template fits everywhere inside the picture: (H - h + 1, W - w + 1) in [-1, 1].

        Args: template (C, h, w), no larger than the picture; mask (h, w) bool, its pixels that count.
        Returns: the cosine between the template's values and the picture's under the mask, less on almost flat ground.
        Raises: ValueError for a larger template.
        """
        (height, width), (h, w) = self.size, mask.shape
        if h > height or w > width:
            raise ValueError(f"a template of {h} x {w} pixels is larger than the picture of {height} x {width}")
        template = template * mask
        inside = (slice(height - h + 1), slice(width - w + 1))
        products = self._summed(self._values, template)[inside]
        energy = self._summed(self._energy[None], mask[None].to(template))[inside]
        norm = template.square().sum().sqrt() * energy.clamp(min=0).sqrt()
        # A quarter of the typical energy: flat ground must not win by having almost none. Where nothing is shown,
        # typical would be none at all, and what is left there is rounding.
        least = 0.5 * norm[norm > 0.01 * norm.max()].median() if norm.max() > 0 else 1.0
        return products / norm.clamp(min=float(least))

    def _summed(self, spectra: Tensor, template: Tensor) -> Tensor:
        """Sums of products of a template (C, h, w) laid at every pixel, over its channels too."""
        products = spectra * torch.fft.rfft2(template, s=self._fast_size).conj()
        return torch.fft.irfft2(products.sum(0), s=self._fast_size)


def _fast_length(length: int) -> int:
    """The next even number without prime factors above 5: transforms of prime length take three times as long."""
    while True:
        rest = length
        for factor in (2, 3, 5):
            while rest % factor == 0:
                rest //= factor
        if rest == 1 and length % 2 == 0:
            return length
        length += 1


def highest_peak(scores: Tensor, apart_px: int, allowed: Tensor | None = None) -> Peak:
    """The highest point of a correlation map (H, W), between pixels by a parabola, and the highest peak further off.

    Args:
        apart_px: the rival's distance at least, along x or y.
        allowed: (H, W) bool, where the point may lie, unlike its rival: if it is but the slope of something higher
            beside, that is the rival, however near.
    """
    possible = scores if allowed is None else torch.where(allowed, scores, -torch.inf)
    y, x = divmod(int(possible.argmax()), scores.shape[1])
    height, width = scores.shape
    # The slope of the point itself, where it is cut off, is no peak: maxima are found before.
    others = torch.where(max_pool2d(scores[None, None], 3, 1, 1)[0, 0] == scores, scores, -1.0)
    others[max(0, y - apart_px) : y + apart_px + 1, max(0, x - apart_px) : x + apart_px + 1] = -1
    rival = max(others.max(), scores.max()) if scores.max() > scores[y, x] else others.max()
    shift_x = _parabola(scores[y, x - 1 : x + 2]) if 0 < x < width - 1 else 0.0
    shift_y = _parabola(scores[y - 1 : y + 2, x]) if 0 < y < height - 1 else 0.0
    return Peak(x + shift_x, y + shift_y, float(scores[y, x]), float(rival))


def _parabola(three: Tensor) -> float:
    """Where the parabola through three values is highest, from the middle one, in [-.5, .5]."""
    left, middle, right = three.tolist()
    bend = left - 2 * middle + right
    return 0.0 if bend >= 0 else max(-0.5, min(0.5, (left - right) / (2 * bend)))
