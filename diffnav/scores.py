"""PSNR and SSIM as every table here reports them: 8-bit RGB round trip, data range 1 (PAPER 8)."""

from kornia.metrics import ssim as ssim_map
from torch import Tensor

from diffnav.images import quantise

# Two equal pictures would score infinity; less than this no different pair of 8-bit pictures up to 5 Mpx scores.
_SMALLEST_MSE = 1e-12


def psnr(image: Tensor, normal: Tensor) -> Tensor:
    """Peak signal-to-noise ratio of each image against its daylight picture, dB: (B,), at most 120 (equal pictures).

    Args: image, normal: (B, 3, H, W); values are rounded to 8 bit and clipped to [0, 1] first.
    """
    mse = (quantise(image.float()) - quantise(normal.float())).square().mean((1, 2, 3))
    return -10 * mse.clamp(min=_SMALLEST_MSE).log10()


def ssim(image: Tensor, normal: Tensor) -> Tensor:
    """Structural similarity of each image to its daylight picture: (B,) in [-1, 1].

    Gaussian window of 11 x 11, sigma 1.5, K1 = .01, K2 = .03, reflected at the borders; the mean over the map and
    the three channels. Source: Wang et al. 2004.

    Args: image, normal: (B, 3, H, W), H and W at least 6; rounded to 8 bit and clipped to [0, 1] first.
    """
    return ssim_map(quantise(image.float()), quantise(normal.float()), 11, max_val=1.0, eps=0.0).mean((1, 2, 3))
