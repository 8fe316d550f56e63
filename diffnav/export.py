"""An enhancer as ONNX: one file that runs without torch, for pictures of any size.

Input `image` (batch, 3, height, width); output `enhanced` alike and, of a Retinex, `illumination` (Ih, one channel).
What the enhancer refuses as too small, the file has no defined result for.
"""

import json
import logging
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import torch
from torch import Tensor, nn
from torch.export import Dim

from diffnav import __version__
from diffnav.checkpoints import checkpoint_sha256, load_enhancer, read_checkpoint
from diffnav.errors import UserError
from diffnav.retinex.enhancer import SMALLEST_PX, RetinexEnhancer
from diffnav.retinex.tiles import TiledEnhancer

if TYPE_CHECKING:
    from onnx import ModelProto
    from onnxruntime import InferenceSession

# What this file's functions import when they are called.
_EXTRA = ("onnx", "onnxscript", "onnxruntime")
CONVENTIONS = (
    "image and enhanced: float32 RGB (batch, 3, height, width) in [0, 1]; illumination: (batch, 1, height, width), Ih; "
    f"any batch, height and width from {SMALLEST_PX} x {SMALLEST_PX}; the picture goes through whole, without tiles"
)


class Whole(nn.Module):
    """The enhancer without its tiles, as it is exported: `enhanced` and, of a Retinex, `illumination`."""

    def __init__(self, enhancer: TiledEnhancer) -> None:
        super().__init__()
        self.enhancer = enhancer

    @property
    def output_names(self) -> list[str]:
        return ["enhanced", "illumination"] if isinstance(self.enhancer, RetinexEnhancer) else ["enhanced"]

    def forward(self, image: Tensor) -> tuple[Tensor, ...]:
        """(B, 3, H, W) in [0, 1] -> the enhanced image in [0, 1] and, of a Retinex, Ih (B, 1, H, W)."""
        if isinstance(self.enhancer, RetinexEnhancer):
            parts = self.enhancer.components(image)
            return parts.enhanced.clamp(0, 1), parts.Ih
        return (self.enhancer._whole(image).clamp(0, 1),)


def export_checkpoint(checkpoint: str | Path, out: Path, commit: str | None = None) -> dict[str, str]:
    """Write a trained enhancer to the file `out`, whole or not at all; the metadata that the file holds.

    Args:
        checkpoint: name of one that ships, weights file or run's folder.
        out: the file to write, in a folder that is made if needed.
        commit: of the code that exports, for the metadata.

    Raises: UserError if there is no such checkpoint, a package is missing, or `out` cannot be written.
    """
    require_export_extra()
    enhancer = load_enhancer(checkpoint)
    metadata = checkpoint_metadata(checkpoint, commit)
    with _written_whole(out) as aside:
        aside.write_bytes(onnx_model(enhancer, metadata).SerializeToString())
    return metadata


def checkpoint_metadata(checkpoint: str | Path, commit: str | None = None) -> dict[str, str]:
    """What an exported file says of itself: checkpoint, sha256, kind, stage, settings, versions, conventions."""
    content = read_checkpoint(checkpoint)
    trained = content.get("provenance", {}).get("commit")
    return {
        "checkpoint": Path(checkpoint).name,
        "sha256": checkpoint_sha256(checkpoint),
        "kind": content["kind"],
        "stage": content["stage"],
        "settings": json.dumps(content["settings"]),
        "conventions": CONVENTIONS,
        "diffnav": __version__,
        "torch": torch.__version__,
        **({"commit": commit} if commit else {}),
        **({"trained_by_commit": str(trained)} if trained else {}),
    }


def onnx_model(enhancer: TiledEnhancer, metadata: dict[str, str] | None = None) -> "ModelProto":
    """The ONNX model of an enhancer in evaluation mode, with `metadata` in its metadata_props.

    Raises: UserError if a package is missing.
    """
    require_export_extra()
    from onnx.helper import set_model_props

    whole = Whole(enhancer).cpu().eval()
    names = ("batch", "height", "width")
    sizes = {0: Dim("batch", min=1), 2: Dim("height", min=SMALLEST_PX), 3: Dim("width", min=SMALLEST_PX)}
    # Sides that need padding, and differ, and a batch of two: nothing that could pass for a constant.
    example = (torch.rand(2, 3, 37, 51, generator=torch.Generator().manual_seed(0)),)
    with _quiet(), torch.no_grad():
        # Deferred: that a reflection is shorter than its picture holds for every size, but is beyond torch to prove.
        graph = torch.export.export(
            whole, example, dynamic_shapes=(sizes,), prefer_deferred_runtime_asserts_over_guards=True
        )
        program = torch.onnx.export(
            graph, example, dynamo=True, input_names=["image"], output_names=whole.output_names, verbose=False
        )
    assert program is not None
    model = program.model_proto
    _forget_origin(model)
    for value in (*model.graph.input, *model.graph.output):
        for axis, name in zip((0, 2, 3), names, strict=True):
            value.type.tensor_type.shape.dim[axis].dim_param = name
    set_model_props(model, metadata or {})
    return model


def onnx_session(model: "ModelProto | Path", threads: int | None = None) -> "InferenceSession":
    """onnxruntime's session of a model or its file, on the CPU with `threads` threads (None: as many as cores).

    Raises: UserError if a package is missing.
    """
    require_export_extra()
    from onnxruntime import InferenceSession, SessionOptions

    options = SessionOptions()
    options.intra_op_num_threads = threads or 0
    source = str(model) if isinstance(model, Path) else model.SerializeToString()
    return InferenceSession(source, options, providers=["CPUExecutionProvider"])


def require_export_extra() -> None:
    """Raise UserError, naming the package, where one that export needs is missing."""
    for name in _EXTRA:
        try:
            import_module(name)
        except ImportError:
            raise UserError(f"ONNX needs the package {name}, which is missing: pip install 'diffnav[export]'") from None


def _forget_origin(model: "ModelProto") -> None:
    """Remove each node's traceback, which names files of this machine, and the sizes of what lies between."""
    del model.graph.value_info[:]
    for node in model.graph.node:
        del node.metadata_props[:]
        node.doc_string = ""
    for function in model.functions:
        for node in function.node:
            del node.metadata_props[:]


@contextmanager
def _written_whole(path: Path) -> Iterator[Path]:
    """A file aside, tried before the long computation, that takes the place of `path` in the end."""
    aside = path.with_name(f".{path.name}.part")
    try:
        if path.is_dir():
            raise UserError(f"{path}: is a folder; give the file to write as out=")
        path.parent.mkdir(parents=True, exist_ok=True)
        aside.touch()
        yield aside
        os.replace(aside, path)
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error.strerror or error}); choose another out=") from None
    finally:
        if aside.is_file():
            aside.unlink()


@contextmanager
def _quiet() -> Iterator[None]:
    """Without what the exporter tells of packages that it does not find, and of its own deprecated calls."""
    logger = logging.getLogger("torch.onnx")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.setLevel(level)
