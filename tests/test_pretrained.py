"""Weights that others published: where they are looked for, and what is said of those that are not there."""

import hashlib
import pickle
from pathlib import Path

import pytest
import torch

from diffnav.errors import UserError
from diffnav.pretrained import file_sha256, load_weights, pretrained_path


def put(folder: Path, content: object = None) -> Path:
    path = folder / "net" / "weights.pt"
    path.parent.mkdir(parents=True)
    torch.save({"w": torch.ones(2)} if content is None else content, path)
    return path


def test_the_folder_is_the_argument_then_the_variable_then_the_usual_one(tmp_path, monkeypatch) -> None:
    given, named, usual = (put(tmp_path / name) for name in ("given", "named", "shared/peers"))
    monkeypatch.setenv("DIFFNAV_WEIGHTS", str(tmp_path / "named"))
    assert pretrained_path("net/weights.pt", "x", str(tmp_path / "given")) == given
    assert pretrained_path("net/weights.pt", "x") == named
    monkeypatch.delenv("DIFFNAV_WEIGHTS")
    (tmp_path / "main").mkdir()
    monkeypatch.chdir(tmp_path / "main")
    assert pretrained_path("net/weights.pt", "x").resolve() == usual


def test_a_missing_file_is_one_sentence(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("DIFFNAV_WEIGHTS", str(tmp_path))
    with pytest.raises(UserError) as caught:
        pretrained_path("net/weights.pt", "example.org/net")
    words = str(caught.value)
    assert "\n" not in words
    assert all(part in words for part in (str(tmp_path / "net" / "weights.pt"), "example.org/net", "DIFFNAV_WEIGHTS"))


def test_weights_are_read_and_hashed(tmp_path) -> None:
    path = put(tmp_path)
    assert load_weights(path)["w"].tolist() == [1, 1]
    assert file_sha256(path) == hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize("content", [b"", b"no weights", pickle.dumps(print, 2)])
def test_a_damaged_file_or_one_with_code_is_one_sentence(content: bytes, tmp_path) -> None:
    path = tmp_path / "broken.pt"
    path.write_bytes(content)
    with pytest.raises(UserError, match=r"^[^\n]*broken\.pt[^\n]+$"):
        load_weights(path)
