"""Each training command, from its command line to its run folder, in two tiny steps."""

import csv
import shutil
from collections.abc import Callable
from pathlib import Path
from unittest.mock import MagicMock

import pytest
import torch
from tiny_training import rows

from diffnav.checkpoints import load_enhancer, read_checkpoint
from diffnav.errors import UserError
from train import decom, enhance, session

TWO = "training.steps=2"


def header(run: Path, table: str) -> list[str]:
    with (run / f"{table}.csv").open(newline="") as file:
        return next(csv.reader(file))


def weights_of(path: Path, part: str) -> torch.Tensor:
    content = read_checkpoint(path)["weights"]
    return torch.cat([tensor.flatten() for name, tensor in content.items() if name.startswith(part)])


@pytest.fixture
def decom_run(tiny: list[str], door: Callable) -> str:
    door(decom.main, *tiny, TWO, "run=first")
    return "first"


def test_decom_fills_its_run_folder(decom_run: str, tmp_path: Path) -> None:
    run = tmp_path / decom_run
    assert {"config.json", "state.pt", "last.pt", "best.pt", "metrics.csv", "validation.csv"} <= {
        path.name for path in run.iterdir()
    }
    assert list(run.glob("events.out.tfevents.*"))
    state = [f"{part}_{what}" for part in ("R", "I", "Ih") for what in ("mean", "std", "saturated")]
    losses = ["reconstruction", "reflectance", "illumination", "total"]
    assert header(run, "metrics") == ["step", *losses, *state, "learning_rate", "images_per_second"]
    assert header(run, "validation") == ["step", *state, "psnr", "ssim"]
    with pytest.raises(UserError, match="holds a Decom-Net alone"):
        load_enhancer(run)


@pytest.mark.parametrize(
    ("settings", "stage", "losses"),
    [
        ([], "enhance", ["brightness", "ssim", "smoothness"]),
        (
            ["train_decom=true"],
            "joint",
            ["brightness", "ssim", "smoothness", "reconstruction", "reflectance", "illumination"],
        ),
        (["train_decom=true", "keep_decom_loss=false"], "joint", ["brightness", "ssim", "smoothness"]),
    ],
)
def test_enhance_goes_on_from_a_decom_run(
    settings: list[str], stage: str, losses: list[str], decom_run: str, tiny, tmp_path: Path, door: Callable
) -> None:
    door(enhance.main, *tiny, TWO, "run=second", f"init={decom_run}", *settings)
    run = tmp_path / "second"
    columns = header(run, "metrics")
    assert columns[1 : columns.index("total")] == losses
    assert {"R_mean", "I_std", "Ih_saturated"} <= set(columns) & set(header(run, "validation"))
    assert read_checkpoint(run)["stage"] == stage
    before, after = (weights_of(tmp_path / name / "last.pt", "decom") for name in (decom_run, "second"))
    assert torch.equal(before, after) == (stage == "enhance")
    before, after = (weights_of(tmp_path / name / "last.pt", "enhance") for name in (decom_run, "second"))
    assert not torch.equal(before, after)
    image = torch.rand(1, 3, 30, 41)
    assert load_enhancer(run)(image).shape == image.shape


def test_direct_needs_no_init(tiny: list[str], tmp_path: Path, door: Callable) -> None:
    door(enhance.main, *tiny, TWO, "run=rival", "stage=direct")
    assert header(tmp_path / "rival", "metrics")[1:4] == ["brightness", "ssim", "total"]
    assert read_checkpoint(tmp_path / "rival")["kind"] == "direct"


def test_folder_is_named_by_stage_and_clock_and_told(tiny, tmp_path: Path, door: Callable, capsys) -> None:
    """With bf16, accumulation and clipping beside it."""
    door(decom.main, *tiny, TWO, "precision=bf16", "training.accumulate=2", "training.clip_norm=1")
    (run,) = (path for path in tmp_path.iterdir() if path.is_dir())
    assert run.name.startswith("decom-")
    said = capsys.readouterr().out
    assert f"run folder: {run}" in said
    assert "2 steps done; validation: " in said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "init is missing"),
        (["init=nowhere"], "no checkpoint nowhere"),
        (["stage=both"], "stage must be retinex or direct"),
        (["stage=direct", "precision=half"], "precision must be float32 or bf16"),
        (["stage=direct", "device=tpu"], "device must be auto, cpu or cuda"),
        (["stage=direct", "training.batch=0"], "training.batch must be"),
        (["stage=direct", "loss.tv=odd"], "loss.tv must be one of wei, literal"),
        (["stage=direct", "data.root=/no/such/folder"], "no folder /no/such/folder"),
        (["stage=direct", "data.split.by=moon"], "split.by must be sources, site or image"),
    ],
)
def test_mistakes_are_one_sentence(arguments: list[str], words: str, tiny, refusal) -> None:
    assert words in refusal(enhance.main, *tiny, TWO, "run=a", *arguments)


def test_checkpoint_of_another_size_or_kind_is_refused(decom_run: str, tiny, refusal) -> None:
    arguments = (*tiny, TWO, "run=a", f"init={decom_run}")
    wider = refusal(enhance.main, *arguments, "network.width=8")
    assert "was trained with network.width=4, now it is 8" in wider
    kind = refusal(enhance.main, *arguments, "stage=direct")
    assert "is a Retinex network" in kind


class TestCompile:
    """torch.compile as a switch."""

    def test_without_compiler_is_one_sentence(self, tiny, refusal, monkeypatch) -> None:
        monkeypatch.setenv("PATH", "")
        monkeypatch.delenv("CXX", raising=False)
        words = refusal(decom.main, *tiny, TWO, "run=a", "compile=true")
        assert "compile=true needs the compiler g++, which is not installed" in words or "clang++" in words
        assert "CXX" in words

    def test_compiler_named_by_the_environment_counts(self, monkeypatch, tmp_path: Path) -> None:
        compiler = tmp_path / "mycxx"
        compiler.write_text("#!/bin/sh\n")
        compiler.chmod(0o755)
        monkeypatch.setenv("PATH", "")
        monkeypatch.setenv("CXX", str(compiler))
        stage = MagicMock()
        session.compile_stage(stage, torch.device("cpu"))
        stage.compile.assert_called_once_with()
        monkeypatch.setenv("CXX", str(tmp_path / "missing"))
        with pytest.raises(UserError, match="missing, which is not installed"):
            session.compile_stage(stage, torch.device("cpu"))

    @pytest.mark.slow
    @pytest.mark.skipif(shutil.which("g++") is None, reason="needs a C++ compiler")
    def test_compiled_stage_trains_alike(self, tiny, tmp_path: Path, door) -> None:
        """Fused kernels round differently: losses of 4 steps agree to 1e-4."""
        for switch in ("true", "false"):
            door(decom.main, *tiny, f"run=compile_{switch}", f"compile={switch}", "training.steps=4")
        compiled, plain = (rows(tmp_path / f"compile_{switch}/metrics.csv") for switch in ("true", "false"))
        assert [float(row["total"]) for row in compiled] == pytest.approx(
            [float(row["total"]) for row in plain], rel=1e-4
        )
