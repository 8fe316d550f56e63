"""Scores and pictures of a stage on a fixed set of whole pairs."""

from collections.abc import Sequence

import torch
from torch import Tensor
from torch.utils.data import Dataset

from diffnav.matching.matches import Matcher
from diffnav.retinex.enhancer import Components, RetinexEnhancer
from diffnav.retinex.state import component_state
from diffnav.scores import psnr, ssim
from diffnav.training.match_check import MatchCheck
from diffnav.training.stages import DecomStage, Stage

PICTURES = 4


class Validation:
    """The fixed set and how to score it. pairs: index -> dict with `low` and `normal` (3, H, W).

    matchers: whose correct matches are counted too.
    """

    def __init__(self, pairs: Dataset, matchers: Sequence[Matcher] = ()) -> None:
        self.pairs = pairs
        self.checks = [MatchCheck(matcher) for matcher in matchers]

    @torch.no_grad()
    def __call__(self, stage: Stage) -> tuple[dict[str, float], dict[str, Tensor]]:
        """(figures, pictures): mean PSNR in dB and SSIM of 8-bit output, the state of R, I, Ih; a few images.

        With matchers, also the mean correct matches of each, `correct_NAME`, and over all, `correct`, and match lines.
        A Decom-Net alone is scored by R_low o I_normal: what a perfect Enhance-Net would make of it.
        """
        was_training = stage.training
        stage.eval()
        device = next(stage.parameters()).device
        sums: dict[str, float] = {}
        pictures: dict[str, Tensor] = {}
        count = len(self.pairs)  # type: ignore[arg-type]
        for index in range(count):
            pair = self.pairs[index]
            low, normal = (pair[key][None].to(device) for key in ("low", "normal"))
            # In float32, as what is trained will be used: bf16 costs a few matches in a hundred.
            views, figures = _enhance(stage, low, normal)
            scores = {"psnr": psnr(views["enhanced"], normal), "ssim": ssim(views["enhanced"], normal)}
            for check in self.checks:
                found, lines = check(index, views["enhanced"][0], normal[0])
                scores[f"correct_{check.name}"] = torch.tensor(float(found))
                if index < PICTURES:
                    pictures[f"{index}_{check.name}"] = lines
            for key, value in (figures | scores).items():
                sums[key] = sums.get(key, 0.0) + value.item() / count
            if index < PICTURES:
                shown = {"low": low, **views, "normal": normal}
                columns = [view.float().expand(-1, 3, -1, -1) for view in shown.values()]
                pictures[str(index)] = torch.cat(columns, 3)[0]
        stage.train(was_training)
        if self.checks:
            sums["correct"] = sum(sums[f"correct_{check.name}"] for check in self.checks) / len(self.checks)
        return sums, pictures


def _enhance(stage: Stage, low: Tensor, normal: Tensor) -> tuple[dict[str, Tensor], dict[str, Tensor]]:
    enhancer = stage.enhancer
    if not isinstance(enhancer, RetinexEnhancer):
        return {"enhanced": enhancer(low)}, {}
    if isinstance(stage, DecomStage):
        (R, I), (_, I_normal) = enhancer.decompose(low), enhancer.decompose(normal)
        parts = Components(R, I, I_normal, R * I_normal)
    else:
        parts = enhancer.components(low)
    return parts._asdict(), component_state(parts)
