"""A run that was killed, interrupted or resumed is, to the bit, the run that nobody touched."""

import hashlib
import json
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tiny_training import rows

from train import decom

STEPS = 30


def digest(run: Path) -> str:
    """SHA-256 of every weight and every tensor of the optimiser in a run's state."""
    state = torch.load(run / "state.pt", weights_only=True)
    sums = hashlib.sha256()
    for name, tensor in sorted(state["model"].items()):
        sums.update(name.encode() + tensor.contiguous().numpy().tobytes())
    for number, moments in sorted(state["optimiser"]["state"].items()):
        for name, tensor in sorted(moments.items()):
            sums.update(f"{number}{name}".encode() + tensor.contiguous().numpy().tobytes())
    return sums.hexdigest()


def assert_same_run(run: Path, other: Path) -> None:
    assert digest(run) == digest(other)
    for table in ("metrics.csv", "validation.csv"):
        assert rows(run / table) == rows(other / table)


def wait_for_step(run: Path, step: int, process) -> None:
    """Return as soon as the run has logged a step; fail if its process ends before."""
    table, deadline = run / "metrics.csv", time.monotonic() + 120
    while not (table.exists() and f"\n{step}," in table.read_text()):
        if process.poll() is not None or time.monotonic() > deadline:
            pytest.fail(f"step {step} was never logged: {process.communicate()[1]}")
        time.sleep(0.002)


def test_killed_and_interrupted_runs_equal_an_untouched_one(tiny: list[str], tmp_path: Path, start: Callable) -> None:
    """SIGKILL before the first save and between saves, SIGINT later, each resumed with the same command."""
    untouched = start("train.decom", *tiny, "run=untouched")
    assert untouched.wait(120) == 0, untouched.communicate()[1]
    assert [int(row["step"]) for row in rows(tmp_path / "untouched/metrics.csv")] == list(range(1, STEPS + 1))
    assert [int(row["step"]) for row in rows(tmp_path / "untouched/validation.csv")] == [10, 20, 30]

    run = tmp_path / "stopped"
    for step in (3, 12):
        process = start("train.decom", *tiny, "run=stopped")
        wait_for_step(run, step, process)
        process.kill()
        assert process.wait(60) == -signal.SIGKILL, "the run ended before it could be killed"

    process = start("train.decom", *tiny, "run=stopped")
    wait_for_step(run, 18, process)
    process.send_signal(signal.SIGINT)
    message = process.communicate(timeout=60)[1].splitlines()[-1]
    assert process.returncode == 2
    reached = int(rows(run / "metrics.csv")[-1]["step"])
    assert 18 <= reached < STEPS
    assert f"stopped at step {reached} of {STEPS} and saved" in message
    assert "run=stopped" in message
    assert torch.load(run / "state.pt", weights_only=True)["step"] == reached

    process = start("train.decom", *tiny, "run=stopped")
    assert process.wait(120) == 0, process.communicate()[1]
    assert_same_run(run, tmp_path / "untouched")


@pytest.fixture
def stopped_at(door: Callable, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Run train.decom in this process and cut it off, unsaved, when it has logged a step."""
    from diffnav.training.run import Run

    class PowerCut(BaseException):
        pass

    def call(step: int, *arguments: str) -> None:
        log = Run.log

        def log_and_die(run: Run, table: str, at: int, figures: dict) -> None:
            log(run, table, at, figures)
            if at == step:
                raise PowerCut

        with monkeypatch.context() as patch:
            patch.setattr(Run, "log", log_and_die)
            with pytest.raises(PowerCut):
                door(decom.main, *arguments)

    return call


def test_logs_hold_every_step_once(tiny: list[str], tmp_path: Path, door: Callable, stopped_at: Callable) -> None:
    """Rows and TensorBoard events beyond the last save go, and so does a line that was only half written."""
    stopped_at(18, *tiny, "run=cut")
    table = tmp_path / "cut/metrics.csv"
    with table.open("a") as file:
        file.write("19,0.00")
    door(decom.main, *tiny, "run=cut")
    assert [int(row["step"]) for row in rows(table)] == list(range(1, STEPS + 1))
    assert all(None not in row.values() for row in rows(table))
    board = EventAccumulator(str(tmp_path / "cut"), size_guidance={"scalars": 0}).Reload()
    assert [event.step for event in board.Scalars("metrics/total")] == list(range(1, STEPS + 1))
    assert [event.step for event in board.Scalars("validation/psnr")] == [10, 20, 30]


def test_header_cut_off_is_written_again(tiny: list[str], tmp_path: Path, door: Callable) -> None:
    (tmp_path / "cut").mkdir()
    (tmp_path / "cut/metrics.csv").write_text("step,recons")
    door(decom.main, *tiny, "run=cut", "training.steps=2")
    assert [row["step"] for row in rows(tmp_path / "cut/metrics.csv")] == ["1", "2"]


def test_validation_is_the_same_before_and_after_resuming(
    tiny: list[str], tmp_path: Path, door: Callable, stopped_at: Callable
) -> None:
    """The fixed set and its darkness do not depend on when the process started."""
    stopped_at(10, *tiny, "run=cut", "training.save_every=9")
    before = rows(tmp_path / "cut/metrics.csv")[-1]
    door(decom.main, *tiny, "run=cut", "training.save_every=9", "training.steps=30")
    door(decom.main, *tiny, "run=whole")
    assert rows(tmp_path / "cut/metrics.csv")[9] == before
    assert rows(tmp_path / "cut/validation.csv") == rows(tmp_path / "whole/validation.csv")


def test_finished_run_is_left_as_it_is(tiny: list[str], tmp_path: Path, door: Callable) -> None:
    door(decom.main, *tiny, "run=a", "training.steps=3")
    before = digest(tmp_path / "a"), (tmp_path / "a/metrics.csv").read_bytes()
    door(decom.main, *tiny, "run=a", "training.steps=3")
    assert (digest(tmp_path / "a"), (tmp_path / "a/metrics.csv").read_bytes()) == before


class TestChangedConfiguration:
    """What may change when a run is resumed, and what may not."""

    @pytest.mark.parametrize(
        ("key", "change"),
        [
            ("optimiser.lr", "optimiser.lr=2e-3"),
            ("network.width", "network.width=5"),
            ("training.batch", "training.batch=4"),
            ("loss.lambda_r", "loss.lambda_r=0.5"),
            ("darkness.gamma", "darkness.gamma=[2,3]"),
            ("seed", "seed=1"),
            ("precision", "precision=bf16"),
            ("validation.seed", "validation.seed=9"),
        ],
    )
    def test_is_refused_by_name(self, tiny, door, refusal, key: str, change: str) -> None:
        door(decom.main, *tiny, "run=a", "training.steps=1")
        assert f"run a was started with {key}=" in refusal(decom.main, *tiny, "run=a", "training.steps=1", change)

    def test_neutral_keys_may_change(self, tiny, tmp_path, door) -> None:
        door(decom.main, *tiny, "run=a", "training.steps=2")
        neutral = ("log_every=3", "validate_every=4", "save_every=5", "workers=1")
        door(decom.main, *tiny, "run=a", "training.steps=2", *(f"training.{change}" for change in neutral))
        assert json.loads((tmp_path / "a/config.json").read_text())["training"]["save_every"] == 5

    def test_constant_schedule_takes_more_steps(self, tiny, tmp_path, door) -> None:
        door(decom.main, *tiny, "run=a", "training.steps=4")
        door(decom.main, *tiny, "run=a", "training.steps=9")
        door(decom.main, *tiny, "run=whole", "training.steps=9")
        assert digest(tmp_path / "a") == digest(tmp_path / "whole")
        assert rows(tmp_path / "a/metrics.csv") == rows(tmp_path / "whole/metrics.csv")

    def test_onecycle_does_not(self, tiny, door, refusal) -> None:
        door(decom.main, *tiny, "run=a", "schedule=onecycle", "training.steps=4")
        message = refusal(decom.main, *tiny, "run=a", "schedule=onecycle", "training.steps=9")
        assert "training.steps=4" in message

    def test_an_attempt_that_trained_nothing_binds_nobody(self, tiny, tmp_path, door, refusal) -> None:
        refusal(decom.main, *tiny, "run=a", "training.batch=3", "training.accumulate=2")
        door(decom.main, *tiny, "run=a", "training.steps=1")
        assert (tmp_path / "a/state.pt").exists()
