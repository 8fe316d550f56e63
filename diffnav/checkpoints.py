"""Enhancers on disk: weights files, the ones that ship, and `load_enhancer`."""

import os
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import torch

from diffnav.enhancers.lightennet import LightenNet
from diffnav.enhancers.zero_dce import ZeroDce
from diffnav.errors import UserError
from diffnav.pretrained import file_sha256, load_weights
from diffnav.retinex.enhancer import DirectEnhancer, RetinexEnhancer
from diffnav.retinex.tiles import TiledEnhancer

KINDS: dict[str, type[TiledEnhancer]] = {
    "retinex": RetinexEnhancer,
    "direct": DirectEnhancer,
    "lightennet": LightenNet,
    "zero_dce": ZeroDce,
}


def save_enhancer(path: Path, enhancer: TiledEnhancer, stage: str, provenance: dict[str, Any]) -> None:
    """Write weights, the settings that rebuild the network, and where they come from; whole or not at all.

    `stage` is decom, enhance, joint, direct, lightennet or zero_dce; `provenance` holds plain values (command,
    commit, step, ...).
    """
    kind = next(name for name, cls in KINDS.items() if type(enhancer) is cls)
    weights = {name: tensor.detach().cpu() for name, tensor in enhancer.state_dict().items()}
    content = {
        "kind": kind, "settings": enhancer.settings, "stage": stage, "weights": weights, "provenance": provenance,
    }  # fmt: skip
    aside = path.with_name(f".{path.name}.part")
    torch.save(content, aside)
    os.replace(aside, path)


def load_enhancer(checkpoint: str | Path, device: str | torch.device = "cpu") -> TiledEnhancer:
    """A trained enhancer in evaluation mode: `(B, 3, H, W)` RGB in [0, 1] -> the same, on `device`.

    `checkpoint` is the name of one that ships (`shipped_checkpoints()`), a weights file, or a run's folder.

    Raises: UserError if there is no such checkpoint, or it holds a Decom-Net alone.
    """
    content = read_checkpoint(checkpoint)
    if content["stage"] == "decom":
        raise UserError(
            f"checkpoint {checkpoint} holds a Decom-Net alone: train its Enhance-Net first "
            f"(python -m train.enhance init={checkpoint})"
        )
    # Channels last: on CPUs a fifth to a third faster, and a fifth less memory.
    enhancer = build_enhancer(content).eval()
    enhancer.sha256 = checkpoint_sha256(checkpoint)
    return enhancer.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]


def build_enhancer(content: dict[str, Any], departures: Mapping[str, Any] | None = None) -> TiledEnhancer:
    """The network of a checkpoint's content, with its weights.

    departures: settings to have otherwise than the checkpoint; layers that come with them begin as new.
    Raises: UserError if weights and settings do not fit.
    """
    departures = departures or {}
    try:
        enhancer = KINDS[content["kind"]](**{**content["settings"], **departures})
        fresh = enhancer.state_dict()
        new = {name: fresh[name] for name in fresh if any(departures.get(part) for part in name.split("."))}
        enhancer.load_state_dict(new | content["weights"], strict=True)
    except (TypeError, RuntimeError, AttributeError) as error:
        raise UserError(
            f"a checkpoint's weights and settings do not fit this version's networks ({_first_line(error)}); "
            "train it anew or use the version that wrote it"
        ) from None
    return enhancer


def read_checkpoint(checkpoint: str | Path) -> dict[str, Any]:
    """The content of a checkpoint: kind, settings, stage, weights, provenance. Raises: UserError."""
    path = find_checkpoint(checkpoint)
    content = load_weights(path)
    if not isinstance(content, dict) or not {"kind", "settings", "stage", "weights"} <= content.keys():
        raise UserError(f"{path}: not a checkpoint of diffnav; give one written by a training command")
    if content["kind"] not in KINDS:
        raise UserError(f"{path}: holds a network of unknown kind {content['kind']!r}; update diffnav")
    return content


def find_checkpoint(checkpoint: str | Path) -> Path:
    """The weights file that a name, file or run folder stands for. Raises: UserError, listing those that ship."""
    shipped = shipped_checkpoints()
    if str(checkpoint) in shipped:
        return shipped[str(checkpoint)]
    path = Path(checkpoint).expanduser()
    for candidate in (path, path / "best.pt", path / "last.pt"):
        if candidate.is_file():
            return candidate
    names = ", ".join(shipped) or "none"
    raise UserError(f"no checkpoint {checkpoint}: give a weights file, a run's folder, or one that ships ({names})")


def shipped_checkpoints() -> dict[str, Path]:
    """Name -> weights file of the checkpoints inside the package."""
    folder = Path(str(resources.files("diffnav") / "weights"))
    return {path.stem: path for path in sorted(folder.glob("*.pt"))}


def checkpoint_sha256(checkpoint: str | Path) -> str:
    """The SHA-256 of a checkpoint's file, in hexadecimal."""
    return file_sha256(find_checkpoint(checkpoint))


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
