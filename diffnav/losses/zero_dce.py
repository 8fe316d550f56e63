"""Zero-DCE's four losses, which know no daylight picture.

Shapes: images (B, 3, H, W) in [0, 1], curves (B, C, H, W); every function returns a scalar >= 0 that is
differentiable in all of its tensors, also where it is 0. Forms and weights are the published code's where the article
differs, for its weights belong to them. Source: Guo et al., Zero-Reference Deep Curve Estimation, CVPR 2020.
"""

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import avg_pool2d

from diffnav.errors import UserError


def spatial_consistency(enhanced: Tensor, low: Tensor, region: int = 4) -> Tensor:
    """How far differences between neighbouring regions change: ((Y_i - Y_j) - (I_i - I_j))^2 over the 4 neighbours j.

    Y, I: means over channels and region x region pixels; summed over j, meaned over i. Neighbours lie inside the
    picture: the published code lets the border's regions neighbour on 0, which holds them dark.
    """
    changed = avg_pool2d((enhanced - low).mean(1, keepdim=True), region)
    down, across = (changed.diff(dim=axis).square().sum() for axis in (2, 3))
    # Each pair of neighbours counts from both sides.
    return 2 * (down + across) / changed.numel()


def exposure(enhanced: Tensor, level: float = 0.6, region: int = 16) -> Tensor:
    """Mean of (Y - level)^2, Y the means over channels and region x region pixels."""
    return (avg_pool2d(enhanced.mean(1, keepdim=True), region) - level).square().mean()


def colour_constancy(enhanced: Tensor) -> Tensor:
    """Mean over pictures of sqrt((R - G)^4 + (R - B)^4 + (G - B)^4), R, G, B the picture's channel means."""
    means = enhanced.mean((2, 3))
    gaps = means - means.roll(1, dims=1)
    # vector_norm, not sqrt: its gradient at a grey picture is 0 instead of NaN.
    return torch.linalg.vector_norm(gaps.square(), dim=1).mean()


def curve_variation(curves: Tensor) -> Tensor:
    """2 sum_c (mean of (dx r_c)^2 + mean of (dy r_c)^2), averaged over the batch."""
    down, across = (curves.diff(dim=axis).square().mean((0, 2, 3)).sum() for axis in (2, 3))
    return 2 * (down + across)


@dataclass(frozen=True)
class ZeroDceLoss:
    """The four terms with their weights, named; each already carries its weight. level: of a well exposed region."""

    spatial: float = 1.0
    exposure: float = 10.0
    colour: float = 5.0
    variation: float = 200.0
    level: float = 0.6

    def __post_init__(self) -> None:
        for name in ("spatial", "exposure", "colour", "variation"):
            if getattr(self, name) < 0:
                raise UserError(f"baseline.loss.{name} must be 0 or more, got {getattr(self, name)}")
        if not 0 < self.level < 1:
            raise UserError(f"baseline.loss.level must lie between 0 and 1, got {self.level}")

    def __call__(self, low: Tensor, enhanced: Tensor, curves: Tensor) -> dict[str, Tensor]:
        """The terms for a batch of dark images, what became of them, and the curves that did it."""
        return {
            "spatial": self.spatial * spatial_consistency(enhanced, low),
            "exposure": self.exposure * exposure(enhanced, self.level),
            "colour": self.colour * colour_constancy(enhanced),
            "variation": self.variation * curve_variation(curves),
        }
