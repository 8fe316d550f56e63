"""The shortened LighterGlue with its own weights, the full ones with random weights under their published names."""

import re
from pathlib import Path

import kornia.feature
import pytest
import torch
from hydra.utils import instantiate
from learned_checks import check_identity, check_matches, check_missing, check_moved, need, save

from conf.command import choice, plain
from diffnav.errors import UserError
from diffnav.matching.ground_truth import correct_matches
from diffnav.matching.learned import strongest
from diffnav.matching.lightglue import LightGlue, kornia_names, network_sizes
from diffnav.matching.xfeat import XFeat
from diffnav.pretrained import pretrained_path

XFEAT, SHORTENED = "xfeat/xfeat_backbone_from_onnx.pt", "lighterglue/lighterglue_L3_from_onnx.pt"
FULL = {"disk_lightglue": "disk", "aliked_lightglue": "aliked"}


class Stub:
    """An extractor with keypoints on a grid; each descriptor is one of `width` unit vectors."""

    def __init__(self, width):
        self.name, self.settings, self.width = "stub", {"features": width}, width

    def features(self, image):
        height, wide = image.shape[1:]
        count = self.width if height > 16 else 0
        steps = torch.linspace(0, 1, max(count, 1))[:count]
        points = torch.stack([steps * (wide - 1), steps.flip(0) * (height - 1)], 1)
        return strongest(points, torch.eye(self.width)[:count], torch.ones(count), count, (height, wide))


def published(width, heads, layers, input_dim, prefix=""):
    """A random LightGlue's state as its authors name it, and the network."""
    with torch.random.fork_rng():
        torch.manual_seed(0)
        network = kornia.feature.LightGlue(
            None, input_dim=input_dim, descriptor_dim=width, num_heads=heads, n_layers=layers
        )
    state = {
        prefix + re.sub(r"^transformers\.(\d+)\.(self|cross)_attn", r"\2_attn.\1", name): tensor
        for name, tensor in network.state_dict().items()
    }
    return state, network


@pytest.fixture(scope="module")
def shortened():
    need(XFEAT, SHORTENED)
    return instantiate(choice("matcher", "lighterglue_l3"))


def test_the_shortened_matcher_finds_what_kornias_class_finds(shortened, picture):
    a, b = shortened.features(picture[:, 32:, 32:]), shortened.features(picture)
    network = kornia.feature.LightGlue(
        None, input_dim=64, descriptor_dim=96, n_layers=3, num_heads=1,
        depth_confidence=-1, width_confidence=-1, filter_threshold=0.1, flash=False,
    )  # fmt: skip
    network.load_state_dict(torch.load(pretrained_path(SHORTENED, ""), weights_only=True), strict=False)
    sides = [
        {"keypoints": f.keypoints[None], "descriptors": f.descriptors[None], "image_size": torch.tensor([[w, h]])}
        for f, (w, h) in ((a, (228.0, 148.0)), (b, (260.0, 180.0)))
    ]
    with torch.no_grad():
        pairs = network.eval()({"image0": sides[0], "image1": sides[1]})["matches"][0]
    expected = {(*a.keypoints[i].tolist(), *b.keypoints[j].tolist()) for i, j in pairs.tolist()}
    matches = shortened.match(a, b)
    assert {tuple(row) for row in torch.cat([matches.points_a, matches.points_b], 1).tolist()} == expected
    assert len(matches) > 20
    assert (matches.confidence > 0.1).all()


def test_a_moved_picture_matches_without_offset(shortened, picture):
    check_moved(shortened, picture[:, :160, :256], offset=(32, 32), least=60)


def test_the_same_each_time(shortened, picture):
    a, b = shortened.features(picture[:, 32:, 32:]), shortened.features(picture)
    first, second = shortened.match(a, b), shortened.match(a, b)
    assert torch.equal(first.points_b, second.points_b)
    assert torch.equal(first.confidence, second.confidence)
    assert not first.confidence.requires_grad


def test_nothing_matches_nothing(shortened, picture):
    nothing, something = shortened.features(torch.zeros(3, 16, 16)), shortened.features(picture)
    for a, b in ((nothing, nothing), (nothing, something), (something, nothing)):
        matches = shortened.match(a, b)
        assert matches.points_a.shape == matches.points_b.shape == (0, 2)
        assert matches.confidence.shape == (0,)


def test_the_settings_name_extractor_and_weights(shortened):
    assert shortened.name == "lighterglue_l3"
    assert shortened.settings["min_confidence"] == 0.1
    assert shortened.settings["extractor"] == {"name": "xfeat", **XFeat().settings}
    check_identity(shortened.settings, pretrained_path(SHORTENED, ""))
    check_identity(shortened.settings["extractor"], pretrained_path(XFEAT, ""))


@pytest.mark.parametrize("prefix", ["", "matcher."])
def test_published_names_become_kornias(prefix, tmp_path):
    state, network = published(32, 2, 3, 8, prefix)
    other = {"extractor.conv.weight": torch.ones(1)} if prefix else {}
    found = kornia_names(state | other, tmp_path)
    assert found.keys() == network.state_dict().keys()
    assert all(torch.equal(found[name], tensor) for name, tensor in network.state_dict().items())
    assert kornia_names(network.state_dict(), tmp_path).keys() == found.keys()


@pytest.mark.parametrize(("width", "heads", "layers", "input_dim"), [(256, 4, 9, 128), (96, 1, 6, 64), (64, 2, 2, 64)])
def test_the_file_tells_the_networks_sizes(width, heads, layers, input_dim, tmp_path):
    state = kornia_names(published(width, heads, layers, input_dim)[0], tmp_path)
    expected = {"descriptor_dim": width, "num_heads": heads, "n_layers": layers, "input_dim": input_dim}
    assert network_sizes(state, tmp_path) == expected


def test_random_weights_in_the_published_layout_load_and_run(tmp_path):
    state, network = published(64, 2, 2, 20)
    matcher = LightGlue(Stub(20), save(state, tmp_path / "some.pth"), name="row", min_confidence=0)
    held = matcher.network.state_dict()
    assert all(torch.equal(held[name], tensor) for name, tensor in network.state_dict().items())
    a, b = (matcher.features(torch.zeros(3, *size)) for size in ((50, 80), (40, 60)))
    matches = matcher.match(a, b)
    assert len(matches) > 0
    check_matches(matches, matcher)
    for points, found in ((matches.points_a, a), (matches.points_b, b)):
        assert {tuple(p) for p in points.tolist()} <= {tuple(p) for p in found.keypoints.tolist()}


@pytest.mark.parametrize("name", FULL)
def test_the_full_ones_compose_and_run(name, tmp_path, monkeypatch, picture):
    with torch.random.fork_rng():
        torch.manual_seed(0)
        save({"extractor": kornia.feature.DISK().state_dict()}, tmp_path / "disk/depth-save.pth")
        save(kornia.feature.ALIKED("aliked-n16").state_dict(), tmp_path / "aliked/aliked-n16.pth")
    save(published(256, 4, 9, 128)[0], tmp_path / f"lightglue/{name}.pth")
    monkeypatch.setenv("DIFFNAV_WEIGHTS", str(tmp_path))
    matcher = instantiate(choice("matcher", name))
    assert (matcher.name, matcher.settings["extractor"]["name"]) == (name, FULL[name])
    found = matcher.features(picture[:, :64, :96])
    matches = matcher.match(found, found)
    check_matches(matches, matcher)
    assert correct_matches(matches, torch.eye(3)).shape == (len(matches),)


def test_the_extractor_runs_where_the_matcher_does():
    cfg = choice("matcher", "lighterglue_l3", {"device": "cuda"})
    assert plain(cfg)["extractor"]["device"] == "cuda"


def test_weights_for_other_features_are_one_sentence(tmp_path):
    weights = save(published(64, 2, 2, 20)[0], tmp_path / "some.pth")
    with pytest.raises(UserError, match=r"^[^\n]*some\.pth: made for 20-D descriptors[^\n]*gives 12-D[^\n]*$"):
        LightGlue(Stub(12), weights)


@pytest.mark.parametrize("content", [{"w": torch.ones(2)}, torch.ones(2), {"transformers.0.x": torch.ones(1)}])
def test_weights_of_something_else_are_one_sentence(content, tmp_path):
    with pytest.raises(UserError, match=r"^[^\n]*some\.pth: not the weights of a LightGlue$"):
        LightGlue(Stub(12), save(content, tmp_path / "some.pth"))


@pytest.mark.parametrize("file", ["lightglue/disk_lightglue.pth", "lightglue/aliked_lightglue.pth"])
def test_missing_weights_are_one_sentence(file, tmp_path, monkeypatch):
    check_missing(lambda: LightGlue(Stub(12), file), tmp_path, monkeypatch, file, "cvg/LightGlue", "DIFFNAV_WEIGHTS")


def test_missing_shortened_weights_name_their_own_source(tmp_path, monkeypatch):
    monkeypatch.setenv("DIFFNAV_WEIGHTS", str(tmp_path))
    with pytest.raises(UserError, match=rf"{re.escape(SHORTENED)}: [^\n]*noahzhy/xfeat_lightglue_onnx"):
        LightGlue(Stub(12), SHORTENED)


@pytest.mark.parametrize("value", [-0.1, 1.0])
def test_a_confidence_out_of_range_is_named(value):
    with pytest.raises(UserError, match=r"matcher\.min_confidence"):
        LightGlue(Stub(12), "some.pth", min_confidence=value)


@pytest.mark.parametrize("name", ["lighterglue_l3", *FULL])
def test_the_configurations_hold_every_argument(name):
    cfg = choice("matcher", name)
    assert cfg.keys() == {"_target_", "extractor", "weights", "name", "min_confidence", "device"}
    assert cfg.name == name
    assert Path(cfg.weights).suffix in (".pt", ".pth")
    # How the extractor would match is its own affair.
    own = choice("matcher", FULL.get(name, "xfeat"))
    assert {**own, "device": None} == {**cfg.extractor, "device": None, "min_cosine": own.min_cosine}
