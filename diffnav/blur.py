"""Gaussian blur, for detectors, descriptors and losses alike."""

from kornia.filters import gaussian_blur2d
from torch import Tensor


def blur(image: Tensor, sigma: float) -> Tensor:
    """The image (B, C, H, W) under a Gaussian of `sigma` pixels, cut at three of them; its edges are mirrored."""
    reach = min(int(3 * sigma + 0.5), min(image.shape[2:]) - 1)
    return gaussian_blur2d(image, 2 * reach + 1, (sigma, sigma), border_type="reflect")
