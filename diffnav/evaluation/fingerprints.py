"""What a result depends on, as a hash: settings, weights, device, libraries, and the code itself."""

import hashlib
import inspect
import json
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from diffnav.evaluation.provenance import versions


def fingerprint(facts: Any, modules: Iterable[str], weights: Mapping[str, Tensor] | None = None) -> str:
    """A hash that changes with any of: `facts` (plain values), tensors, library versions, the modules' code.

    modules: names; every module of this package that they draw functions and classes from counts as well.
    """
    digest = hashlib.sha256(json.dumps([facts, _libraries()], sort_keys=True).encode())
    for name, tensor in (weights or {}).items():
        digest.update(f"{name} {tensor.dtype} {tuple(tensor.shape)}".encode())
        digest.update(tensor.detach().cpu().contiguous().view(-1).view(torch.uint8).numpy().tobytes())
    for module in sorted(modules_behind(modules)):
        digest.update(Path(inspect.getfile(sys.modules[module])).read_bytes())
    return digest.hexdigest()


def modules_behind(names: Iterable[str]) -> set[str]:
    """The modules of this package that these modules draw functions and classes from, themselves included."""
    found: set[str] = set()
    waiting = [name for name in names if name.partition(".")[0] == __package__.partition(".")[0]]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            origins = (getattr(value, "__module__", None) for value in vars(sys.modules[name]).values())
            waiting += [o for o in origins if isinstance(o, str) and o.split(".")[0] == name.split(".")[0]]
    return found


@cache
def _libraries() -> dict[str, str]:
    # Not Python's own version: no picture depends on it.
    return {name: version for name, version in versions().items() if name != "python"}
