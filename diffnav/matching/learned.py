"""What the learned matchers share: weights from a file into a frozen network, features from its output."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import torch
from torch import Tensor, nn

from diffnav.errors import UserError
from diffnav.matching.matches import Features
from diffnav.pretrained import file_sha256, filling_from, load_weights, pretrained_path

Network = TypeVar("Network", bound=nn.Module)


@dataclass(frozen=True)
class Weights:
    """A published weights file and what it holds, on the CPU."""

    path: Path
    content: Any

    @property
    def settings(self) -> dict[str, str]:
        """What identifies the file in a matcher's settings wherever it lies: its name and its SHA-256."""
        return {"weights": self.path.name, "weights_sha256": file_sha256(self.path)}

    def part(self, key: str) -> Any:
        """What the file holds under `key`. Raises: UserError if there is nothing."""
        if not isinstance(self.content, Mapping) or key not in self.content:
            raise UserError(f"{self.path}: holds no {key!r}; give the file as its authors published it")
        return self.content[key]


def open_weights(weights: str, source: str) -> Weights:
    """The file `weights`, below the folder of published weights or with its whole path (`pretrained_path`).

    `source` tells a user where the file comes from. Raises: UserError if it is missing or cannot be read.
    """
    given = Path(weights).expanduser()
    if given.is_absolute() and not given.is_file():
        raise UserError(f"no weights file {given}: set matcher.weights to where it is (it comes from {source})")
    path = pretrained_path(str(given), source)
    return Weights(path, load_weights(path))


def freeze(
    network: Network, state: Any, path: Path, device: str | torch.device, may_lack: tuple[str, ...] = ()
) -> Network:
    """The network filled with a state dict, on `device`, in evaluation mode, without gradients.

    Args:
        state: name -> tensor, from the file `path`, which only error messages name.
        may_lack: beginnings of names that the file need not have: parts that do not run, constants.
    Raises: UserError if the state does not fit the network, or torch has no such device.
    """
    with filling_from(path):
        missing, unexpected = network.load_state_dict(state, strict=False)
    for lack in [name for name in missing if not name.startswith(may_lack)][:1]:
        raise UserError(f"{path}: not the weights of this network (it lacks {lack}); replace it")
    if unexpected:
        raise UserError(f"{path}: not the weights of this network (it holds {unexpected[0]}); replace it")
    try:
        network = network.to(device)
    except (RuntimeError, AssertionError) as error:
        reason = str(error).strip().splitlines()[0]
        raise UserError(f"matcher.device={device} cannot be used ({reason}); use cpu") from None
    return network.eval().requires_grad_(False)


def device_of(network: nn.Module) -> torch.device:
    """Where the network's weights are."""
    return next(network.parameters()).device


def strongest(keypoints: Tensor, descriptors: Tensor, scores: Tensor, most: int, size: tuple[int, int]) -> Features:
    """Features on the CPU, at most `most` of them, the strongest first.

    Args: keypoints (N, 2) x, y in pixels; descriptors (N, D); scores (N,); size (h, w) of the image.
    """
    order = scores.argsort(descending=True, stable=True)[:most]
    kept = [part[order].float().cpu() for part in (keypoints, descriptors, scores)]
    return Features(kept[0], kept[1], kept[2], size)


def no_features(width: int, size: tuple[int, int]) -> Features:
    """The features of an image (h, w) that shows none: descriptors are (0, width)."""
    return Features(torch.zeros(0, 2), torch.zeros(0, width), torch.zeros(0), size)
