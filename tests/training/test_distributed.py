"""Two processes under torchrun train what one process trains."""

import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from omegaconf import OmegaConf
from tiny_training import ENVIRONMENT, REPOSITORY, rows

from diffnav.checkpoints import save_enhancer
from diffnav.errors import UserError
from diffnav.retinex.enhancer import RetinexEnhancer
from diffnav.training.distributed import Crew
from train import decom, session


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def torchrun(*program: str) -> subprocess.CompletedProcess:
    """`torchrun --nproc_per_node=2 program`."""
    here = ["--master_addr=127.0.0.1", f"--master_port={free_port()}", "--nproc_per_node=2"]
    return subprocess.run(
        [sys.executable, "-m", "torch.distributed.run", *here, *program],
        cwd=REPOSITORY,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=300,
    )


LOSSES = ("reconstruction", "reflectance", "illumination", "total")


def test_two_processes_reach_the_losses_of_one(tiny: list[str], tmp_path: Path, door: Callable) -> None:
    """12 steps of 4 samples, 2 for each process, resumed after 6: losses and scores within 1e-4 of one process's.

    Gradients are summed in another order, which Adam, dividing by small moments, carries into the fifth digit.
    """
    settings = (*tiny, "training.batch=4", "training.save_every=6")
    for steps in (6, 12):
        done = torchrun("-m", "train.decom", *settings, "run=two", f"training.steps={steps}")
        assert done.returncode == 0, done.stderr
    door(decom.main, *settings, "run=one", "training.steps=12")
    for table, names in (("metrics", LOSSES), ("validation", ("psnr", "ssim", "R_mean", "I_mean"))):
        one, two = (rows(tmp_path / name / f"{table}.csv") for name in ("one", "two"))
        assert [row["step"] for row in two][-len(one) :] == [row["step"] for row in one]
        for ours, theirs in zip(two[-len(one) :], one, strict=True):
            expected = [float(theirs[name]) for name in names]
            assert [float(ours[name]) for name in names] == pytest.approx(expected, rel=1e-4)
    assert len(rows(tmp_path / "two/metrics.csv")) == 12


def test_two_processes_fine_tune_and_save_what_the_loss_remembers(tiny: list[str], tmp_path: Path) -> None:
    torch.manual_seed(0)
    save_enhancer(tmp_path / "init.pt", RetinexEnhancer(width=4, padding="zeros"), "joint", {})
    settings = (*tiny, f"init={tmp_path / 'init.pt'}", "data.patch=64", "validation.matchers=[]", "training.batch=4")
    done = torchrun("-m", "train.finetune", *settings, "run=two", "training.steps=2")
    assert done.returncode == 0, done.stderr
    state = torch.load(tmp_path / "two" / "state.pt", weights_only=True)
    assert state["memory"]["balance.norm_paper"] > 0
    assert len(rows(tmp_path / "two" / "metrics.csv")) == 2


TRAIN_AND_LEAVE = """
import torch
from pathlib import Path
from diffnav.training.distributed import join_crew, leave_crew

def train(crew):
    layer = torch.nn.Linear(1, 1, bias=False)
    wrapped = crew.wrap(layer)
    wrapped(torch.tensor([[4.0 * crew.rank]])).sum().backward()
    return layer.weight.grad.item()

crew = join_crew(torch.device("cpu"))
assert train(crew) == 2.0
leave_crew(crew)
names = [task.joinpath("comm").read_text().strip() for task in Path("/proc/self/task").glob("*")]
assert not [name for name in names if "gloo" in name], names
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="names of threads are read from Linux's /proc")
def test_no_thread_outlives_the_process_group(tmp_path: Path) -> None:
    """A thread of gloo that is alive when the interpreter ends may abort the process."""
    program = tmp_path / "train.py"
    program.write_text(TRAIN_AND_LEAVE)
    done = torchrun(str(program))
    assert done.returncode == 0, done.stderr


def test_processes_need_a_name_for_their_run() -> None:
    """By the clock they might choose two folders."""
    cfg = OmegaConf.create({"run": None, "schedule": {"_target_": "diffnav.training.schedules.Constant"}})
    with pytest.raises(UserError, match="give run=NAME when several processes train together"):
        session.open_run(cfg, "decom", Crew(rank=1, size=2))
