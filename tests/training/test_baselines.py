"""The learned baselines' stages and their command."""

import csv
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from tiny_training import column, rows, train

from diffnav.checkpoints import load_enhancer, read_checkpoint
from diffnav.enhancers.lightennet import LightenNet
from diffnav.enhancers.zero_dce import ZeroDce
from diffnav.losses.zero_dce import ZeroDceLoss
from diffnav.training.baselines import LightenNetStage, ZeroDceStage
from diffnav.training.stages import Stage
from train import baseline, enhance


@pytest.fixture
def tiny_baseline(tiny: list[str]) -> list[str]:
    """`tiny` for train.baseline, whose networks have one size."""
    return [setting for setting in tiny if not setting.startswith("network.")]


def make_stage(name: str) -> Stage:
    torch.manual_seed(0)
    return LightenNetStage(LightenNet()) if name == "lightennet" else ZeroDceStage(ZeroDce(), ZeroDceLoss())


def batch() -> tuple[torch.Tensor, torch.Tensor]:
    normal = torch.rand(2, 3, 32, 32, generator=torch.Generator().manual_seed(0))
    return normal**4, normal


def test_lightennet_is_compared_as_a_picture() -> None:
    """One loss: the mean square of S / L - S_normal, not clipped, so that what is too bright has a gradient."""
    low, normal = batch()
    stage = make_stage("lightennet").train()
    losses, figures = stage(low, normal)
    with torch.no_grad():
        enhanced = low / stage.enhancer.illumination(low)
    assert enhanced.max() > 1
    assert {name: loss.item() for name, loss in losses.items()} == {
        "brightness": pytest.approx(((enhanced - normal) ** 2).mean().item(), rel=1e-5)
    }
    assert figures == {}


def test_zero_dce_does_not_look_at_daylight() -> None:
    low, normal = batch()
    stage = make_stage("zero_dce").train()
    losses, figures = stage(low, normal)
    assert list(losses) == ["spatial", "exposure", "colour", "variation"]
    assert set(figures) == {"r_mean", "r_std"}
    other, _ = stage(low, 1 - normal)
    assert all(torch.equal(losses[name], other[name]) for name in losses)


@pytest.mark.parametrize("name", ["lightennet", "zero_dce"])
def test_losses_fall_and_stay_float32_under_bf16(name: str, tmp_path: Path) -> None:
    stage = make_stage(name)
    stage.bf16 = True
    losses, _ = stage.train()(*batch())
    assert all(loss.dtype == torch.float32 for loss in losses.values())
    train(tmp_path, stage, steps=12, optimiser=lambda trained, lr: torch.optim.Adam(trained, lr=lr / 10))
    totals = column(tmp_path, "total")
    assert sum(totals[-3:]) < sum(totals[:3])


@pytest.mark.parametrize("name", ["lightennet", "zero_dce"])
def test_the_command_trains_resumes_and_saves(name: str, tiny_baseline, tmp_path: Path, door: Callable) -> None:
    arguments = [*tiny_baseline, f"baseline={name}", "schedule=constant"]
    door(baseline.main, *arguments, "training.steps=4", "run=whole")
    door(baseline.main, *arguments, "training.steps=2", "run=parts")
    door(baseline.main, *arguments, "training.steps=4", "run=parts")
    whole, parts = (read_checkpoint(tmp_path / run / "last.pt")["weights"] for run in ("whole", "parts"))
    assert all(torch.equal(parts[key], value) for key, value in whole.items())
    assert [row["step"] for row in rows(tmp_path / "parts" / "metrics.csv")] == ["1", "2", "3", "4"]
    content = read_checkpoint(tmp_path / "whole")
    assert (content["kind"], content["stage"]) == (name, name)
    image = torch.rand(1, 3, 30, 41)
    assert load_enhancer(tmp_path / "whole")(image).shape == image.shape
    with (tmp_path / "whole" / "validation.csv").open(newline="") as file:
        assert next(csv.reader(file)) == ["step", "psnr", "ssim"]


def test_without_a_baseline_it_says_what_there_is(tiny_baseline, refusal: Callable) -> None:
    words = refusal(baseline.main, *tiny_baseline, "run=a")
    assert "baseline=" in words
    assert "lightennet" in words
    assert "zero_dce" in words


def test_train_enhance_does_not_take_a_baseline(tiny, tiny_baseline, door: Callable, refusal) -> None:
    door(baseline.main, *tiny_baseline, "baseline=zero_dce", "training.steps=1", "run=curves")
    assert "is a baseline" in refusal(enhance.main, *tiny, "run=b", "init=curves")
