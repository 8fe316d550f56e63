"""Enhancers on disk: equal after loading, and one sentence for everything that is no enhancer."""

import hashlib
import pickle
from pathlib import Path

import pytest
import torch

from diffnav import checkpoints
from diffnav.checkpoints import (
    build_enhancer,
    checkpoint_sha256,
    find_checkpoint,
    load_enhancer,
    read_checkpoint,
    save_enhancer,
    shipped_checkpoints,
)
from diffnav.enhancers.lightennet import LightenNet
from diffnav.enhancers.zero_dce import ZeroDce
from diffnav.errors import UserError
from diffnav.retinex.enhancer import DirectEnhancer, RetinexEnhancer

KINDS = {RetinexEnhancer: "retinex", DirectEnhancer: "direct", LightenNet: "lightennet", ZeroDce: "zero_dce"}
UNUSUAL = {"width": 3, "jump": "concat", "max_channel": False, "up_kernel": 2, "activation": "none", "padding": "zeros"}


def settings_of(kind: type) -> dict:
    return UNUSUAL if kind in (RetinexEnhancer, DirectEnhancer) else {}


@pytest.fixture(params=KINDS)
def enhancer(request):
    torch.manual_seed(0)
    return request.param(**settings_of(request.param))


def save_content(path: Path, **changes) -> Path:
    """A checkpoint with some of its entries changed; None leaves an entry out."""
    save_enhancer(path, RetinexEnhancer(width=2), "enhance", {})
    content = torch.load(path, weights_only=True) | changes
    torch.save({key: value for key, value in content.items() if value is not None}, path)
    return path


def test_loading_gives_back_what_was_saved(tmp_path, enhancer):
    path = tmp_path / "möwe 1.pt"
    save_enhancer(path, enhancer, "joint", {"step": 12, "commit": "abc"})
    loaded = load_enhancer(path)
    assert type(loaded) is type(enhancer)
    assert not loaded.training
    assert loaded.settings == enhancer.settings == settings_of(type(enhancer))
    assert loaded.state_dict().keys() == enhancer.state_dict().keys()
    assert all(torch.equal(loaded.state_dict()[key], value) for key, value in enhancer.state_dict().items())
    image = torch.rand(1, 3, 17, 23, generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        # The layout in memory may differ, and with it the last bit of a sum.
        torch.testing.assert_close(loaded(image), enhancer.eval()(image), atol=1e-6, rtol=0)
    content = read_checkpoint(path)
    assert content["kind"] == KINDS[type(enhancer)]
    assert loaded.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert (content["stage"], content["provenance"]) == ("joint", {"step": 12, "commit": "abc"})
    assert sorted(p.name for p in tmp_path.iterdir()) == ["möwe 1.pt"], "nothing is left beside it"


def test_saving_is_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "best.pt"
    save_enhancer(path, RetinexEnhancer(width=2), "enhance", {})
    before = path.read_bytes()

    def cut_short(content, target):  # noqa: ARG001
        Path(target).write_bytes(b"half")
        raise OSError("No space left on device")

    monkeypatch.setattr(torch, "save", cut_short)
    with pytest.raises(OSError, match="No space left"):
        save_enhancer(path, RetinexEnhancer(width=2), "enhance", {})
    assert path.read_bytes() == before


def test_a_run_folder_stands_for_its_best_weights(tmp_path):
    save_enhancer(tmp_path / "last.pt", RetinexEnhancer(width=2), "enhance", {})
    assert find_checkpoint(tmp_path) == tmp_path / "last.pt"
    save_enhancer(tmp_path / "best.pt", RetinexEnhancer(width=3), "enhance", {})
    assert find_checkpoint(str(tmp_path)) == tmp_path / "best.pt"
    assert load_enhancer(tmp_path).settings["width"] == 3
    assert checkpoint_sha256(tmp_path) == hashlib.sha256((tmp_path / "best.pt").read_bytes()).hexdigest()


def test_an_unknown_name_lists_those_that_ship(tmp_path, monkeypatch):
    with pytest.raises(UserError, match=r"^no checkpoint compact_jiont: ") as caught:
        load_enhancer("compact_jiont")
    assert all(name in str(caught.value) for name in shipped_checkpoints())
    save_enhancer(tmp_path / "b.pt", RetinexEnhancer(width=2), "joint", {})
    monkeypatch.setattr(checkpoints, "shipped_checkpoints", lambda: {"first": tmp_path / "b.pt", "second": tmp_path})
    assert load_enhancer("first").settings["width"] == 2
    with pytest.raises(UserError, match=r"no checkpoint third: .*\(first, second\)$"):
        load_enhancer("third")


@pytest.mark.parametrize("name", shipped_checkpoints() or [None])
def test_every_shipped_checkpoint_loads(name):
    if name is None:
        pytest.skip("no checkpoint ships in diffnav/weights yet")
    loaded = load_enhancer(name)
    image = torch.rand(1, 3, 32, 40, generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        enhanced = loaded(image * 0.1)
    assert enhanced.isfinite().all()
    assert all(p.isfinite().all() for p in loaded.parameters())


def test_a_decom_net_alone_is_refused(tmp_path):
    save_enhancer(tmp_path / "decom.pt", RetinexEnhancer(width=2), "decom", {})
    with pytest.raises(UserError, match=r"decom\.pt holds a Decom-Net alone: .*train\.enhance init=.*decom\.pt"):
        load_enhancer(tmp_path / "decom.pt")
    assert isinstance(build_enhancer(read_checkpoint(tmp_path / "decom.pt")), RetinexEnhancer)


@pytest.mark.parametrize("damage", ["empty", "truncated", "text", "pickle", "tensor", "dict", "code", "folder"])
def test_a_damaged_file_is_one_sentence(tmp_path, damage):
    path = tmp_path / f"{damage}.pt"
    save_enhancer(path, RetinexEnhancer(width=2), "enhance", {})
    content = path.read_bytes()
    if damage == "folder":
        path.unlink()
        path.mkdir()
    elif damage == "tensor":
        torch.save(torch.zeros(3), path)
    elif damage == "dict":
        torch.save({"model": torch.zeros(3)}, path)
    else:
        written = {"empty": b"", "truncated": content[: len(content) // 2], "text": b"not weights"}
        written |= {"pickle": pickle.dumps([1, 2], 2), "code": pickle.dumps(print, 2)}
        path.write_bytes(written[damage])
    with pytest.raises(UserError, match=rf"^[^\n]*{damage}\.pt[^\n]+$"):
        load_enhancer(path)


@pytest.mark.parametrize(
    "changes",
    [
        {"kind": "transformer"},
        {"kind": None},
        {"weights": None},
        {"weights": {"decom.layers.0.weight": torch.zeros(1)}},
        {"settings": {"width": 4}},
        {"settings": {"breadth": 4}},
    ],
)
def test_content_of_another_version_is_one_sentence(tmp_path, changes):
    with pytest.raises(UserError, match=r"^[^\n]+$"):
        load_enhancer(save_content(tmp_path / "a.pt", **changes))
