"""The stages that train the learned baselines: LightenNet on pairs, Zero-DCE on dark pictures alone."""

from torch import Tensor

from diffnav.enhancers.lightennet import LightenNet
from diffnav.enhancers.zero_dce import ZeroDce, apply_curves
from diffnav.losses.zero_dce import ZeroDceLoss
from diffnav.training.stages import Figures, Losses, Stage


class LightenNetStage(Stage):
    """LightenNet with the mean squared error of its picture.

    The article compares illumination maps, each drawn constant over a patch. Ours follow from Eq. 9: one for each
    channel, and unknown where the dark picture is black, so the picture itself is compared. Little hangs on it: after
    1,000 steps 15.8 dB on the validation sources, against 15.7 with the map of max(R, G, B).
    """

    name = "lightennet"
    enhancer: LightenNet

    def forward(self, low: Tensor, normal: Tensor) -> tuple[Losses, Figures]:
        with self.autocast(low):
            enhanced = self.enhancer(low)
        return {"brightness": (enhanced - normal).square().mean()}, {}


class ZeroDceStage(Stage):
    """Zero-DCE with its four losses; the daylight patches are not looked at."""

    name = "zero_dce"
    enhancer: ZeroDce

    def __init__(self, enhancer: ZeroDce, loss: ZeroDceLoss, bf16: bool = False) -> None:
        super().__init__(enhancer, bf16)
        self.loss = loss

    def forward(self, low: Tensor, normal: Tensor) -> tuple[Losses, Figures]:  # noqa: ARG002
        with self.autocast(low):
            curves = self.enhancer.curves(low)
        enhanced = apply_curves(low, curves)
        return self.loss(low, enhanced, curves), {"r_mean": curves.mean(), "r_std": curves.std()}
