"""A run's folder: its configuration, its exact state, its logs, its checkpoints.

runs/NAME/config.json      the resolved configuration
          state.pt         everything a resumed run needs (model, optimiser, step, best value, RNG states)
          last.pt best.pt  weights, for `load_enhancer`
          metrics.csv      one row a logged step;  validation.csv one row a validation
          events.out...    TensorBoard
          lock             held by the process that trains
"""

import csv
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from torch import Tensor
from torch.utils.tensorboard import SummaryWriter

from diffnav.checkpoints import save_enhancer
from diffnav.errors import UserError
from diffnav.training.lock import FolderLock
from diffnav.training.stages import Stage


class Run:
    """The folder of one training run; opening it again resumes.

    config: nested plain values. neutral: dotted keys that may differ on resuming since no result depends on
    them. writes: whether this process writes into the folder; of several that train together, one does.

    Raises: UserError if the folder holds a run of another configuration, naming the first key that differs,
    cannot be written, or is another process's at the moment.
    """

    def __init__(
        self,
        folder: Path,
        config: Mapping[str, Any],
        neutral: frozenset[str] = frozenset(),
        writes: bool = True,
    ) -> None:
        self.folder = Path(folder)
        self.config = config
        self._writes = writes
        self._writer: SummaryWriter | None = None
        self._lock: FolderLock | None = None
        self._state_path = self.folder / "state.pt"
        stored = self.folder / "config.json"
        # Without a state nothing was trained: a first attempt with a wrong setting binds nobody.
        if self._state_path.exists() and stored.exists():
            _refuse_changes(self.folder.name, _flat(json.loads(stored.read_text())), _flat(config), neutral)
        if writes:
            try:
                self.folder.mkdir(parents=True, exist_ok=True)
                self._lock = FolderLock(self.folder)
                _write_whole(stored, json.dumps(config, indent=1))
            except OSError as error:
                raise UserError(
                    f"{self.folder}: cannot be written ({error.strerror}); change run or paths.runs"
                ) from None

    def restore(self, stage: Stage, optimiser: torch.optim.Optimizer) -> tuple[int, float]:
        """Load the saved state, if any: (steps done, best value so far); drop what was logged after it."""
        if not self._state_path.exists():
            step, best = 0, float("-inf")
        else:
            state = torch.load(self._state_path, map_location="cpu", weights_only=True)
            stage.enhancer.load_state_dict(state["model"], strict=True)
            stage.memory.load_state_dict(state.get("memory", {}), strict=True)
            optimiser.load_state_dict(state["optimiser"])
            torch.set_rng_state(state["rng"])
            # A run may go on on a machine with other GPUs, or none.
            if len(state["cuda_rng"]) == torch.cuda.device_count():
                torch.cuda.set_rng_state_all(state["cuda_rng"])
            step, best = state["step"], state["best"]
        if self._writes:
            for name in ("metrics.csv", "validation.csv"):
                _truncate_csv(self.folder / name, step)
        return step, best

    def save(self, stage: Stage, optimiser: torch.optim.Optimizer, step: int, best: float) -> None:
        """Write the state and the last weights; each file appears whole or not at all."""
        state = {
            "model": stage.enhancer.state_dict(),
            "memory": stage.memory.state_dict(),
            "optimiser": optimiser.state_dict(),
            "step": step,
            "best": best,
            "rng": torch.get_rng_state(),
            "cuda_rng": torch.cuda.get_rng_state_all() if torch.cuda.is_available() else [],
        }
        self.save_weights("last", stage, step)
        aside = self._state_path.with_suffix(".part")
        torch.save(state, aside)
        os.replace(aside, self._state_path)

    def save_weights(self, name: str, stage: Stage, step: int) -> None:
        """Write NAME.pt, a checkpoint for `load_enhancer`."""
        provenance = {"run": self.folder.name, "step": step, "config": json.dumps(self.config)}
        save_enhancer(self.folder / f"{name}.pt", stage.enhancer, stage.name, provenance)

    def writer(self, step: int) -> SummaryWriter:
        """TensorBoard's writer; events from `step` on, written in an earlier life of this run, are hidden."""
        if self._writer is None:
            self._writer = SummaryWriter(str(self.folder), purge_step=step)
        return self._writer

    def log(self, table: str, step: int, figures: Mapping[str, float]) -> None:
        """Append one row to TABLE.csv, and the figures to TensorBoard under TABLE/."""
        row = {"step": step, **figures}
        path = self.folder / f"{table}.csv"
        new = not path.exists() or path.stat().st_size == 0
        with path.open("a", newline="") as file:
            rows = csv.DictWriter(file, list(row))
            if new:
                rows.writeheader()
            rows.writerow({key: repr(value) if isinstance(value, float) else value for key, value in row.items()})
        for name, value in figures.items():
            self.writer(step).add_scalar(f"{table}/{name}", value, step)

    def draw(self, table: str, step: int, pictures: Mapping[str, Tensor]) -> None:
        """Pictures (3, H, W) in [0, 1] to TensorBoard, under TABLE/."""
        for name, picture in pictures.items():
            self.writer(step).add_image(f"{table}/{name}", picture.clamp(0, 1), step)

    def close(self) -> None:
        """Flush the logs and leave the folder to others."""
        if self._writer is not None:
            self._writer.close()
        if self._lock is not None:
            self._lock.release()


def _flat(config: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in config.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = value
    return flat


def _refuse_changes(name: str, old: dict[str, Any], new: dict[str, Any], neutral: frozenset[str]) -> None:
    for key in sorted((old.keys() | new.keys()) - neutral):
        if old.get(key) != new.get(key):
            raise UserError(
                f"run {name} was started with {key}={old.get(key)}, now it is {new.get(key)}: "
                "give the old value to resume, or another run= name to start anew"
            )


def _truncate_csv(path: Path, step: int) -> None:
    """Keep the header and the rows up to `step`; a half-written last line goes too."""
    if not path.exists():
        return
    # Bytes: the csv module's line ends stay as they are.
    lines = [line for line in path.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]
    kept = [line for line in lines[1:] if int(line.split(b",", 1)[0]) <= step]
    _write_whole(path, b"".join([*lines[:1], *kept]))


def _write_whole(path: Path, content: str | bytes) -> None:
    aside = path.with_name(f".{path.name}.part")
    aside.write_bytes(content.encode() if isinstance(content, str) else content)
    os.replace(aside, path)
