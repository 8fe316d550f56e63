"""Scores on the fixed set, the best checkpoint they choose, and the state of R, I and Ih beside them."""

from pathlib import Path

import pytest
import torch
from tiny_training import Patches, column, make_stage, train, weights
from torch import Tensor

from diffnav.checkpoints import read_checkpoint
from diffnav.retinex.enhancer import RetinexEnhancer
from diffnav.retinex.state import illumination_is_alive
from diffnav.training.stages import EnhanceStage, Stage
from diffnav.training.validation import Validation


def test_best_checkpoint_is_the_best(tmp_path: Path) -> None:
    """Prescribed scores 10, 30, 20, nan dB at steps 1 to 4: best.pt holds step 2, last.pt step 4."""
    seen: dict[int, Tensor] = {}

    def validate(stage: Stage) -> tuple[dict[str, float], dict]:
        seen[len(seen) + 1] = weights(stage)
        return {"psnr": [10.0, 30.0, 20.0, float("nan")][len(seen) - 1]}, {}

    train(tmp_path, validate=validate, validate_every=1)
    for name, step in (("best", 2), ("last", 4)):
        content = read_checkpoint(tmp_path / f"{name}.pt")
        assert content["provenance"]["step"] == step
        enhancer = RetinexEnhancer(**content["settings"])
        enhancer.load_state_dict(content["weights"])
        assert torch.equal(torch.nn.utils.parameters_to_vector(enhancer.parameters()), seen[step])
    assert torch.load(tmp_path / "state.pt", weights_only=True)["best"] == 30.0


def test_validation_scores_are_those_of_the_pictures(tmp_path: Path) -> None:
    """PSNR worked out here from the enhanced, rounded pictures, image by image."""
    stage = train(tmp_path)
    figures, pictures = Validation(Patches())(stage)
    scores = []
    for number in range(len(Patches())):
        pair = Patches()[number]
        with torch.no_grad():
            levels = (stage.enhancer.eval()(pair["low"][None])[0] * 255).round()
        mse = ((levels / 255 - pair["normal"]).double() ** 2).mean().item()
        scores.append(10 * torch.log10(torch.tensor(1 / mse)).item())
    assert figures["psnr"] == pytest.approx(sum(scores) / len(scores), rel=1e-5)
    # low, R, I, Ih, enhanced and normal side by side.
    assert {picture.shape for picture in pictures.values()} == {(3, 16, 6 * 16)}
    stage.train()
    Validation(Patches())(stage)
    assert stage.training


def test_collapsed_illumination_shows_in_both_tables(tmp_path: Path) -> None:
    """An Ih driven to 1 everywhere, as the joint stage without L_Decom ends, is seen where one looks."""
    stage = make_stage(EnhanceStage, train_decom=True)
    torch.nn.init.zeros_(stage.enhancer.enhance.last.weight)
    torch.nn.init.constant_(stage.enhancer.enhance.last.bias, 12.0)
    train(tmp_path / "collapsed", stage, validate=Validation(Patches()), steps=2)
    train(tmp_path / "alive", make_stage(EnhanceStage, train_decom=True), validate=Validation(Patches()), steps=2)
    for table in ("metrics", "validation"):
        dead = {name: column(tmp_path / "collapsed", name, table)[-1] for name in ("Ih_mean", "Ih_std", "Ih_saturated")}
        assert dead["Ih_mean"] > 0.99
        assert dead["Ih_saturated"] == 1
        assert not illumination_is_alive(dead)
        assert column(tmp_path / "alive", "Ih_saturated", table)[-1] == 0


def test_resumed_run_does_not_forget_its_best(tmp_path: Path) -> None:
    """30 dB at step 2, then a resumed run that reaches but 20 dB."""
    for steps, psnr in ((2, 30.0), (4, 20.0)):
        train(tmp_path, validate=lambda *_, psnr=psnr: ({"psnr": psnr}, {}), validate_every=2, steps=steps)
    assert read_checkpoint(tmp_path / "best.pt")["provenance"]["step"] == 2
    assert column(tmp_path, "psnr", "validation") == [30.0, 20.0]
