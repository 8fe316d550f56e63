"""Eq. 2-8 of the paper, term by term. All norms are means over pixels and channels (D10).

Shapes: S, R (B, 3, H, W); I, Ih (B, 1, H, W); values in [0, 1]; every function returns a scalar >= 0 that is
differentiable in all of its tensors.
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from kornia.metrics import ssim
from torch import Tensor
from torch.nn.functional import avg_pool2d, pad

from diffnav.errors import UserError

Smoothness = Callable[[Tensor, Tensor, float], Tensor]


def reconstruction(R: Tensor, I: Tensor, S: Tensor) -> Tensor:
    """Mean of (R o I - S)^2: one image's part of Eq. 3."""
    return (R * I - S).square().mean()


def reflectance_consistency(R_low: Tensor, R_normal: Tensor) -> Tensor:
    """Mean of (R_low - R_normal)^2, Eq. 4."""
    return (R_low - R_normal).square().mean()


def smoothness_wei(I: Tensor, R: Tensor, lambda_tv: float = 10.0) -> Tensor:
    """Total variation of I, weighted down where the reflectance has edges: Eq. 5 as its cited source computes it.

    mean(|dx I| exp(-lambda a_x)) + the same in y, with a the 3x3 average of |d grey(R)|, grey of BT.601.
    Differences lie inside the image, averages replicate the border. 0 for a constant I.
    Source: Wei et al., Deep Retinex Decomposition, 2018; gradient flows through R too.
    """
    grey = (R * R.new_tensor([0.299, 0.587, 0.114])[:, None, None]).sum(1, keepdim=True)
    total = I.new_zeros(())
    for axis in (3, 2):
        edges = _average3x3(grey.diff(dim=axis).abs())
        total = total + (I.diff(dim=axis).abs() * torch.exp(-lambda_tv * edges)).mean()
    return total


def smoothness_literal(I: Tensor, R: Tensor, lambda_tv: float = 10.0) -> Tensor:
    """mean |I exp(-lambda R)|: Eq. 5 as printed, without the gradient signs; its minimum is I = 0 (D9)."""
    return (I * torch.exp(-lambda_tv * R)).abs().mean()


def illumination_smoothness(tv: str) -> Smoothness:
    """The reading of Eq. 5 named `tv`: wei or literal. Raises: UserError for another name."""
    readings: dict[str, Smoothness] = {"wei": smoothness_wei, "literal": smoothness_literal}
    if tv not in readings:
        raise UserError(f"loss.tv must be one of {', '.join(readings)}, got {tv!r}")
    return readings[tv]


def brightness_error(enhanced: Tensor, S_normal: Tensor, lambda_re1: float = 0.5, lambda_re2: float = 1.5) -> Tensor:
    """lambda_re1 mean of squares + lambda_re2 mean of absolutes of Ih o R_low - S_normal, Eq. 7."""
    error = enhanced - S_normal
    return lambda_re1 * error.square().mean() + lambda_re2 * error.abs().mean()


def ssim_loss(enhanced: Tensor, S_normal: Tensor) -> Tensor:
    """1 - SSIM, Eq. 8: window 11, sigma 1.5, range 1; twice kornia's `ssim_loss`, which halves."""
    return 1 - ssim(enhanced, S_normal, window_size=11, max_val=1.0).mean()


def _average3x3(x: Tensor) -> Tensor:
    return avg_pool2d(pad(x, (1, 1, 1, 1), mode="replicate"), 3, stride=1)


@dataclass(frozen=True)
class RetinexLoss:
    """Eq. 2 and 6 with their weights, as named terms that add up; each already carries its weight.

    Defaults are the paper's. With Adam a common factor hardly matters: the three .01 make Eq. 2 a 1:1:1 sum.
    `lambda_smooth` weighs L_i' in Eq. 6 (the paper: 1).
    """

    lambda_re: float = 0.01
    lambda_r: float = 0.01
    lambda_i: float = 0.01
    lambda_tv: float = 10.0
    lambda_re1: float = 0.5
    lambda_re2: float = 1.5
    lambda_smooth: float = 1.0
    tv: str = "wei"

    def __post_init__(self) -> None:
        illumination_smoothness(self.tv)

    def decomposition(
        self, low: Tensor, normal: Tensor, low_RI: tuple[Tensor, Tensor], normal_RI: tuple[Tensor, Tensor]
    ) -> dict[str, Tensor]:
        """The terms of L_Decom, Eq. 2, from both images and their (R, I)."""
        smooth = illumination_smoothness(self.tv)
        recon = reconstruction(*low_RI, low) + reconstruction(*normal_RI, normal)
        smoothness = smooth(low_RI[1], low_RI[0], self.lambda_tv) + smooth(normal_RI[1], normal_RI[0], self.lambda_tv)
        return {
            "reconstruction": self.lambda_re * recon,
            "reflectance": self.lambda_r * reflectance_consistency(low_RI[0], normal_RI[0]),
            "illumination": self.lambda_i * smoothness,
        }

    def enhancement(self, enhanced: Tensor, Ih: Tensor, R_low: Tensor, normal: Tensor) -> dict[str, Tensor]:
        """The terms of L_Enhance, Eq. 6."""
        smooth = illumination_smoothness(self.tv)
        return {
            **self.fidelity(enhanced, normal),
            "smoothness": self.lambda_smooth * smooth(Ih, R_low, self.lambda_tv),
        }

    def fidelity(self, enhanced: Tensor, normal: Tensor) -> dict[str, Tensor]:
        """Eq. 7 and 8 alone: what a network without illumination can be trained with."""
        return {
            "brightness": brightness_error(enhanced, normal, self.lambda_re1, self.lambda_re2),
            "ssim": ssim_loss(enhanced, normal),
        }
