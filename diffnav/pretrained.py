"""Weights that others published: found in a folder of the user's, never shipped, never downloaded by us."""

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import torch

from diffnav.errors import UserError

# The environment variable that names the folder of published weights, and the folder without it.
WEIGHTS_VARIABLE = "DIFFNAV_WEIGHTS"
DEFAULT_WEIGHTS = "../shared/peers"


def pretrained_path(relative: str, source: str, folder: str | None = None) -> Path:
    """The weights file `relative` (xfeat/xfeat.pt) below `folder`, else $DIFFNAV_WEIGHTS, else ../shared/peers.

    `source` tells a user where the file comes from. Raises: UserError if it is not there.
    """
    path = Path(folder or os.environ.get(WEIGHTS_VARIABLE) or DEFAULT_WEIGHTS).expanduser() / relative
    if not path.is_file():
        raise UserError(
            f"no weights file {path}: put it there (it comes from {source}), "
            f"or set {WEIGHTS_VARIABLE} to the folder that holds {relative}"
        )
    return path


def load_weights(path: Path) -> Any:
    """What a weights file holds, on the CPU; only tensors and plain values are read, never code.

    Raises: UserError if it cannot be read.
    """
    try:
        return torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # torch raises a different type for each way a file can be damaged
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise UserError(f"{path}: not a weights file that can be read ({reason}); replace it") from None


@contextmanager
def filling_from(path: Path) -> Iterator[None]:
    """Around what fills a network from a file: its failure becomes a UserError that names the file."""
    try:
        yield
    except (RuntimeError, TypeError, AttributeError, KeyError, IndexError, ValueError) as error:
        # torch lists what does not fit below a headline.
        reason = (str(error).strip().splitlines() or [type(error).__name__])[-1].strip()
        raise UserError(f"{path}: not the weights of this network ({reason}); replace it") from None


def file_sha256(path: Path) -> str:
    """The SHA-256 of a file, in hexadecimal."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
