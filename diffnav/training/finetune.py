"""The fine-tune stage: matcher-aware terms beside the losses of the joint, the frozen or the direct stage."""

from collections.abc import Mapping

import torch
from torch import Tensor

from diffnav.losses.hybrid import HybridLoss
from diffnav.matching.descriptors.descriptor import Descriptor
from diffnav.training.balance import Balance, Curriculum, pulled
from diffnav.training.matcher_terms import MatcherTerms
from diffnav.training.stages import EnhancingStage, Figures, Losses, Stage

# The terms of Eq. 6, which w_p weighs; L_Decom's, where it is kept, stand for themselves.
_PAPER_TERMS = ("brightness", "ssim", "smoothness")


class FinetuneStage(Stage):
    """A stage's own losses + sum of w_k (|g_paper| / |g_k|) L_k, with g the gradients at the enhanced picture.

    Each matcher-aware term is weighed by the gradient that it sends into the picture: with weight 1 it pulls as hard
    as Eq. 7 and 8 together do, whatever its values are. base: the stage that makes the picture (Enhance-Net alone,
    both networks, or the direct rival), of whose loss the paper's part is weighed by w_p.
    """

    name = "finetune"

    def __init__(self, base: EnhancingStage, loss: HybridLoss, descriptors: Mapping[str, Descriptor]) -> None:
        super().__init__(base.enhancer, base.bf16)
        self.base = base
        self.loss = loss
        self.terms = MatcherTerms(loss, descriptors)
        matches = [f"match_{name}" for name in self.terms.descriptors]
        self.memory["balance"] = self.balance = Balance(["paper", "structure", "detector", *matches, "homography"])
        self.memory["curriculum"] = self.curriculum = Curriculum(loss.h_below, loss.h_ramp)

    def forward(self, low: Tensor, normal: Tensor, H_view_normal: Tensor, exposure: Tensor) -> tuple[Losses, Figures]:
        """Args: low, normal (B, 3, H, W); H_view_normal (B, 3, 3), exposure (B,): see `ViewedPair`."""
        enhanced, losses, figures = self.base.outcome(low, normal)
        weights = {name: self.loss.w_p if name in _PAPER_TERMS else 1.0 for name in losses}
        own = {name: weights[name] * value for name, value in losses.items() if weights[name]}
        aware, more = self._matcher_aware(enhanced, normal, H_view_normal, exposure)
        return own | aware, figures | more

    @torch.compiler.disable
    def _matcher_aware(
        self, enhanced: Tensor, normal: Tensor, H_view_normal: Tensor, exposure: Tensor
    ) -> tuple[Losses, Figures]:
        """The weighted terms; figures: raw values, gradient norms, and what the terms themselves report."""
        # A leaf of its own: the terms' graphs end here, and only their weighted sum goes on through the networks.
        picture = enhanced.detach().float().requires_grad_()
        with torch.enable_grad():
            terms, figures = self.terms(picture, normal, H_view_normal, exposure)
            paper = torch.stack(list(self.loss.fidelity(picture, normal).values())).sum()
            gradients = self.balance.pulls({"paper": paper} | terms, picture)
        factors = {name: self.balance.share(name, gradients[name]) for name in terms}
        if "homography" in terms:
            matches = [value for name, value in figures.items() if name.startswith("raw_match_")]
            figures["curriculum"] = self.curriculum.step(torch.stack(matches).mean())
            factors["homography"] = factors["homography"] * figures["curriculum"]
        losses: Losses = {}
        for name, value in terms.items():
            factor = self.loss.weights[name.split("_")[0]] * factors[name]
            losses[name] = pulled(factor * value, factor * gradients[name], enhanced)
        figures |= {f"raw_{name}": value.detach() for name, value in terms.items()}
        return losses, figures | {f"gradient_{name}": gradient.norm() for name, gradient in gradients.items()}
