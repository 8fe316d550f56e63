"""An exported enhancer gives what the enhancer gives, whatever the size, and says what it is."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import torch

from diffnav import export
from diffnav.checkpoints import checkpoint_sha256, load_enhancer, save_enhancer
from diffnav.enhancers.lightennet import LightenNet
from diffnav.errors import UserError
from diffnav.export import export_checkpoint, onnx_model, onnx_session
from diffnav.retinex.enhancer import DirectEnhancer, RetinexEnhancer

onnx = pytest.importorskip("onnx", reason="the extra `export` is not installed")
pytest.importorskip("onnxruntime", reason="the extra `export` is not installed")
pytest.importorskip("onnxscript", reason="the extra `export` is not installed")

ROOT = Path(__file__).parents[1]
# (B, H, W): multiples of 8 and not, odd, upright, the smallest, batches.
SIZES = [(1, 32, 32), (1, 33, 47), (3, 64, 40), (2, 57, 35), (1, 95, 39), (1, 16, 17)]
PAPER = {"width": 3, "padding": "replicate", "jump": "concat", "up_kernel": 2}
MAKERS = {
    "compact_joint": lambda: load_enhancer("compact_joint"),
    "matcher": lambda: load_enhancer("matcher"),
    "paper": lambda: RetinexEnhancer(**PAPER, reflectance="exact", detail=True),
    "direct": lambda: DirectEnhancer(width=4),
    "lightennet": LightenNet,
}


def pictures(batch, height, width):
    return torch.rand(batch, 3, height, width, generator=torch.Generator().manual_seed(height)) ** 3


@pytest.fixture(scope="module", params=MAKERS)
def exported(request):
    torch.manual_seed(0)
    enhancer = MAKERS[request.param]().eval()
    return enhancer, onnx_session(onnx_model(enhancer), threads=1)


def test_every_size_gives_what_the_network_gives(exported):
    enhancer, session = exported
    for size in SIZES:
        image = pictures(*size)
        with torch.no_grad():
            expected = enhancer(image)
        enhanced = torch.from_numpy(session.run(["enhanced"], {"image": image.numpy()})[0])
        assert enhanced.shape == image.shape
        torch.testing.assert_close(enhanced, expected, rtol=0, atol=1e-4)


def test_the_illumination_is_that_of_a_retinex_and_of_no_other(exported):
    enhancer, session = exported
    names = [output.name for output in session.get_outputs()]
    if not isinstance(enhancer, RetinexEnhancer):
        assert names == ["enhanced"]
        return
    image = pictures(2, 41, 50)
    with torch.no_grad():
        expected = enhancer.components(image).Ih
    illumination = torch.from_numpy(session.run(["illumination"], {"image": image.numpy()})[0])
    torch.testing.assert_close(illumination, expected, rtol=0, atol=1e-4)


def test_sizes_are_free_and_named(exported):
    _, session = exported
    image = session.get_inputs()[0]
    assert (image.name, image.type, image.shape) == ("image", "tensor(float)", ["batch", 3, "height", "width"])
    assert session.get_outputs()[0].shape == ["batch", 3, "height", "width"]


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """The checkpoint of a small network."""
    path = tmp_path_factory.mktemp("checkpoint") / "small.pt"
    save_enhancer(path, RetinexEnhancer(width=2), "joint", {"commit": "abc", "step": 1})
    return path


def test_the_command_writes_a_sound_file_that_says_what_it_is(small, tmp_path):
    out = tmp_path / "made" / "small.onnx"
    done = subprocess.run(
        [sys.executable, "-m", "eval.export", f"checkpoint={small}", f"out={out}"],
        cwd=ROOT, capture_output=True, text=True, timeout=500,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert checkpoint_sha256(small) in done.stdout
    assert [path.name for path in out.parent.iterdir()] == ["small.onnx"]
    model = onnx.load(out)
    onnx.checker.check_model(model, full_check=True)
    said = {entry.key: entry.value for entry in model.metadata_props}
    assert (said["checkpoint"], said["sha256"], said["trained_by_commit"]) == (
        "small.pt", checkpoint_sha256(small), "abc"
    )  # fmt: skip
    assert json.loads(said["settings"])["width"] == 2
    assert "float32 RGB" in said["conventions"]
    # Nothing of the machine that wrote it.
    assert str(ROOT).encode() not in out.read_bytes()
    assert str(small.parent).encode() not in out.read_bytes()


def test_mistakes_are_one_sentence(small, tmp_path, monkeypatch):
    out = tmp_path / "x.onnx"
    with pytest.raises(UserError, match=r"no checkpoint nowhere: give .*compact_joint"):
        export_checkpoint("nowhere", out)
    with pytest.raises(UserError, match="is a folder; give the file to write as out="):
        export_checkpoint(small, tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"x\.onnx: cannot be written .*; choose another out="):
        export_checkpoint(small, tmp_path / "file" / "x.onnx")
    monkeypatch.setitem(sys.modules, "onnxscript", None)
    with pytest.raises(UserError, match=r"needs the package onnxscript, which is missing: pip install"):
        export_checkpoint(small, out)
    assert not out.exists()


def test_a_failure_leaves_neither_half_a_file_nor_a_changed_one(small, tmp_path, monkeypatch):
    out = tmp_path / "x.onnx"
    out.write_bytes(b"before")
    monkeypatch.setattr(export, "onnx_model", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        export_checkpoint(small, out)
    assert [path.name for path in tmp_path.iterdir()] == ["x.onnx"]
    assert out.read_bytes() == b"before"
