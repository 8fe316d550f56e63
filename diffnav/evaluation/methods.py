"""The rows of a table: an enhancer with its name, and a fingerprint that changes whenever its output could."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import torch
from torch import nn

from diffnav.checkpoints import checkpoint_sha256, find_checkpoint, load_enhancer, shipped_checkpoints
from diffnav.errors import UserError
from diffnav.evaluation.fingerprints import fingerprint
from diffnav.evaluation.provenance import processor_name


@dataclass(frozen=True)
class Method:
    """One row. enhancer: in evaluation mode, on its device, `(image, record)` -> image, all (B, 3, H, W) in [0, 1].

    settings: plain values that, with the weights, decide its output. sha256: of its checkpoint's file, if any.
    """

    name: str
    enhancer: nn.Module
    settings: Mapping[str, Any]
    sha256: str | None = None

    @property
    def parameters(self) -> int:
        return sum(p.numel() for p in self.enhancer.parameters())

    @property
    def megabytes(self) -> float:
        """Size of the weights in float32, MB (10^6 bytes)."""
        return self.parameters * 4 / 1e6

    @property
    def device(self) -> torch.device:
        """Where it runs: networks where their weights are, everything else on the CPU."""
        first = next(self.enhancer.parameters(), None)
        return first.device if first is not None else torch.device("cpu")

    @property
    def needs_record(self) -> bool:
        """Whether it needs to know how a picture was darkened, which nobody does of real darkness."""
        return getattr(self.enhancer, "needs_record", False)

    @cached_property
    def fingerprint(self) -> str:
        """A hash of settings, weights, code, libraries and device.

        Equal prints give equal images, but for the last bit of sums, whose order follows from the threads.
        """
        facts = [dict(self.settings), processor_name(self.device)]
        modules = {type(part).__module__ for part in self.enhancer.modules()}
        return fingerprint(facts, modules, self.enhancer.state_dict())


def checkpoint_methods(checkpoints: Sequence[str | Path], device: torch.device) -> list[Method]:
    """One row per checkpoint: the name of a shipped one, a file, or a run's folder.

    A row is named after the shipped checkpoint, the run's folder or the file; where two would share a name, both
    are called as they were given.

    Raises: UserError, listing those that ship, if there is no such checkpoint.
    """
    names = [_checkpoint_name(str(checkpoint)) for checkpoint in checkpoints]
    methods = []
    for checkpoint, name in zip(checkpoints, names, strict=True):
        enhancer = load_enhancer(checkpoint, device)
        label = name if names.count(name) == 1 else str(checkpoint)
        settings = {**enhancer.settings, "tile_pixels": enhancer.tile_pixels}
        methods.append(Method(label, enhancer, settings, checkpoint_sha256(checkpoint)))
    return methods


def require_distinct(methods: Sequence[Method]) -> None:
    """Raise UserError where two rows share a name."""
    names = [method.name for method in methods]
    for name in names:
        if names.count(name) > 1:
            raise UserError(f"two rows would be called {name}: rename one of the checkpoints or leave one out")


def _checkpoint_name(checkpoint: str) -> str:
    if checkpoint in shipped_checkpoints():
        return checkpoint
    path = find_checkpoint(checkpoint)
    return path.resolve().parent.name if path.stem in ("best", "last") else path.stem
