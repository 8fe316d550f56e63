"""What the learned matchers share: weights into a frozen network, features out of it."""

import hashlib
from pathlib import Path

import pytest
import torch
from learned_checks import save
from torch import nn

from diffnav.errors import UserError
from diffnav.matching.learned import device_of, freeze, no_features, open_weights, strongest


def small():
    return nn.Sequential(nn.Linear(2, 3), nn.BatchNorm1d(3))


def test_weights_are_known_by_name_and_content_wherever_they_lie(tmp_path, monkeypatch):
    here, there = (Path(save({"w": torch.ones(2)}, tmp_path / place / "net.pt")) for place in ("a/net", "b/net"))
    sha256 = hashlib.sha256(here.read_bytes()).hexdigest()
    monkeypatch.setenv("DIFFNAV_WEIGHTS", str(tmp_path / "a"))
    found = open_weights("net/net.pt", "x")
    assert found.path == here
    assert found.content["w"].tolist() == [1, 1]
    assert found.settings == {"weights": "net.pt", "weights_sha256": sha256}
    assert open_weights(str(there), "x").path == there
    monkeypatch.setenv("HOME", str(tmp_path / "b"))
    assert open_weights("~/net/net.pt", "x").path == there


def test_a_missing_file_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setenv("DIFFNAV_WEIGHTS", str(tmp_path))
    with pytest.raises(UserError, match=r"^no weights file .*/net/net\.pt: put it there .*example\.org/net.*$"):
        open_weights("net/net.pt", "example.org/net")
    with pytest.raises(UserError, match=r"^no weights file .*/net\.pt: set matcher\.weights .*example\.org/net.*$"):
        open_weights(str(tmp_path / "net.pt"), "example.org/net")


def test_a_file_with_code_is_not_run(tmp_path):
    # Unpickled without care, this would call print.
    with pytest.raises(UserError, match=r"net\.pt"):
        open_weights(save({"w": print}, tmp_path / "net.pt"), "x")


def test_a_part_that_the_file_lacks_is_named(tmp_path):
    found = open_weights(save({"model": 1}, tmp_path / "net.pt"), "x")
    assert found.part("model") == 1
    with pytest.raises(UserError, match=r"net\.pt: holds no 'extractor'"):
        found.part("extractor")
    with pytest.raises(UserError, match="holds no 'extractor'"):
        open_weights(save(torch.ones(3), tmp_path / "net.pt"), "x").part("extractor")


def test_a_frozen_network_has_the_files_values_and_learns_nothing():
    state = {name: torch.full_like(tensor, 2) for name, tensor in small().state_dict().items()}
    network = freeze(small(), state, Path("net.pt"), "cpu")
    assert all((parameter == 2).all() and not parameter.requires_grad for parameter in network.parameters())
    assert not any(module.training for module in network.modules())
    assert device_of(network) == torch.device("cpu")
    before = network[1].running_mean.clone()
    network(torch.rand(4, 2))
    assert torch.equal(network[1].running_mean, before)


def test_only_what_may_be_lacking_may_be_lacking():
    state = small().state_dict()
    part = {name: tensor for name, tensor in state.items() if not name.startswith("1.")}
    assert torch.equal(freeze(small(), part, Path("net.pt"), "cpu", may_lack=("1.",))[0].bias, state["0.bias"])
    with pytest.raises(UserError, match=r"^net\.pt: .*lacks 1\.weight"):
        freeze(small(), part, Path("net.pt"), "cpu")
    with pytest.raises(UserError, match=r"^net\.pt: .*lacks 1\.weight"):
        freeze(small(), part, Path("net.pt"), "cpu", may_lack=("0.",))


@pytest.mark.parametrize(
    ("state", "words"),
    [
        (small().state_dict() | {"2.bias": torch.ones(1)}, "it holds 2.bias"),
        (small().state_dict() | {"0.bias": torch.ones(5)}, "size mismatch for 0.bias"),
        ("text", "not the weights"),
        (torch.ones(2), "not the weights"),
    ],
)
def test_weights_of_another_network_are_one_sentence(state, words):
    with pytest.raises(UserError) as caught:
        freeze(small(), state, Path("net.pt"), "cpu")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("net.pt: ")


@pytest.mark.parametrize("device", ["gpu", "cuda:99"])
def test_a_device_that_is_not_there_is_one_sentence(device):
    with pytest.raises(UserError, match=rf"^matcher\.device={device} cannot be used [^\n]*; use cpu$"):
        freeze(small(), small().state_dict(), Path("net.pt"), device)


def test_the_strongest_come_first_and_the_others_not_at_all():
    keypoints, descriptors = torch.arange(8.0).reshape(4, 2), torch.eye(4)
    found = strongest(keypoints, descriptors, torch.tensor([0.2, 0.9, 0.5, 0.5]), 3, (10, 20))
    assert found.keypoints.tolist() == [[2, 3], [4, 5], [6, 7]]
    assert found.descriptors.argmax(1).tolist() == [1, 2, 3]
    assert found.scores.tolist() == pytest.approx([0.9, 0.5, 0.5])
    assert found.size == (10, 20)
    assert found.image is None


def test_no_features_have_a_width():
    nothing = no_features(64, (3, 4))
    assert len(nothing) == 0
    assert (nothing.keypoints.shape, nothing.descriptors.shape) == ((0, 2), (0, 64))
