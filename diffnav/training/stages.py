"""The stages of training: each maps a batch of dark and daylight patches to named losses."""

from typing import Any

import torch
from torch import Tensor, nn

from diffnav.losses.retinex import RetinexLoss
from diffnav.retinex.enhancer import Components, DirectEnhancer, Enhancer, RetinexEnhancer
from diffnav.retinex.state import component_state
from diffnav.retinex.tiles import TiledEnhancer

Losses = dict[str, Tensor]
Figures = dict[str, Tensor]


class Stage(nn.Module):
    """What the loop trains: `stage(**batch)`, of low and normal -> (named losses that add up, figures to watch).

    Networks run in bf16 under autocast where `bf16` is set, losses always in float32. Frozen parameters have
    `requires_grad` False. `memory`: what a stage remembers from step to step; it is saved with the run's state.
    """

    name: str
    enhancer: TiledEnhancer

    def __init__(self, enhancer: TiledEnhancer, bf16: bool = False) -> None:
        super().__init__()
        self.enhancer = enhancer
        self.bf16 = bf16
        self.memory = nn.ModuleDict()

    def autocast(self, like: Tensor) -> Any:
        return torch.autocast(like.device.type, dtype=torch.bfloat16, enabled=self.bf16)


class RetinexStage(Stage):
    """A stage of the two networks (or of their plain rival) with the paper's losses."""

    def __init__(self, enhancer: Enhancer, loss: RetinexLoss, bf16: bool = False) -> None:
        super().__init__(enhancer, bf16)
        self.loss = loss


class EnhancingStage(RetinexStage):
    """A stage whose networks give a picture: what `outcome` makes of a batch is what `forward` returns, less that."""

    def outcome(self, low: Tensor, normal: Tensor) -> tuple[Tensor, Losses, Figures]:
        """The enhanced pictures, the named losses and the figures to watch."""
        raise NotImplementedError

    def forward(self, low: Tensor, normal: Tensor) -> tuple[Losses, Figures]:
        _, losses, figures = self.outcome(low, normal)
        return losses, figures


class DecomStage(RetinexStage):
    """Stage one: Decom-Net on both images with L_Decom (Eq. 2)."""

    name = "decom"
    enhancer: RetinexEnhancer

    def __init__(self, enhancer: RetinexEnhancer, loss: RetinexLoss, bf16: bool = False) -> None:
        super().__init__(enhancer, loss, bf16)
        enhancer.enhance.requires_grad_(False)

    def forward(self, low: Tensor, normal: Tensor) -> tuple[Losses, Figures]:
        with self.autocast(low):
            R, I = self.enhancer.decompose(torch.cat([low, normal]))
        n = len(low)
        losses = self.loss.decomposition(low, normal, (R[:n], I[:n]), (R[n:], I[n:]))
        return losses, component_state(Components(R[:n], I[:n], I[n:], low))


class EnhanceStage(EnhancingStage):
    """Stage two: Enhance-Net with L_Enhance (Eq. 6), Decom-Net frozen; with `train_decom`, the joint stage.

    The joint stage trains both networks and, where `decom_loss` is given, keeps L_Decom beside L_Enhance:
    without it the smoothness term pulls Ih to a constant and Decom-Net becomes a plain restoration network.
    """

    enhancer: RetinexEnhancer

    def __init__(
        self,
        enhancer: RetinexEnhancer,
        loss: RetinexLoss,
        bf16: bool = False,
        train_decom: bool = False,
        decom_loss: RetinexLoss | None = None,
    ) -> None:
        super().__init__(enhancer, loss, bf16)
        self.train_decom = train_decom
        self.decom_loss = decom_loss if train_decom else None
        self.name = "joint" if train_decom else "enhance"
        enhancer.decom.requires_grad_(train_decom)
        enhancer.enhance.requires_grad_(True)

    def outcome(self, low: Tensor, normal: Tensor) -> tuple[Tensor, Losses, Figures]:
        with self.autocast(low):
            parts = self.enhancer.components(low)
        losses = self.loss.enhancement(parts.enhanced, parts.Ih, parts.R, normal)
        if self.decom_loss is not None:
            with self.autocast(low):
                normal_RI = self.enhancer.decompose(normal)
            losses |= self.decom_loss.decomposition(low, normal, (parts.R, parts.I), normal_RI)
        return parts.enhanced, losses, component_state(parts)


class DirectStage(EnhancingStage):
    """The plain rival: the same trunks, image to image, with Eq. 7 and 8."""

    name = "direct"
    enhancer: DirectEnhancer

    def outcome(self, low: Tensor, normal: Tensor) -> tuple[Tensor, Losses, Figures]:
        with self.autocast(low):
            enhanced = self.enhancer(low)
        return enhanced, self.loss.fidelity(enhanced, normal), {}
