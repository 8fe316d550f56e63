"""LoFTR's published weights are not here: random ones, in a file of the published layout, stand for them."""

from pathlib import Path

import kornia.feature
import pytest
import torch
from learned_checks import check_arguments, check_identity, check_matches, check_missing, save

from diffnav.errors import UserError
from diffnav.matching.learned import no_features
from diffnav.matching.loftr import Loftr, to_pixel_centres


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    with torch.random.fork_rng():
        torch.manual_seed(0)
        state = kornia.feature.LoFTR(pretrained=None).state_dict()
    named = {f"matcher.{name}": tensor for name, tensor in state.items()}
    return save({"state_dict": named, "epoch": 29}, tmp_path_factory.mktemp("loftr") / "loftr_outdoor.ckpt")


@pytest.fixture(scope="module")
def loftr(weights):
    """Random weights are sure of nothing: every match counts."""
    return Loftr(min_confidence=0.0, weights=weights)


def test_the_network_holds_the_files_weights(loftr, weights):
    expected = torch.load(weights, weights_only=True)["state_dict"]
    held = loftr.network.state_dict()
    assert {f"matcher.{name}" for name in held} == expected.keys()
    assert all(torch.equal(held[name.removeprefix("matcher.")], tensor) for name, tensor in expected.items())
    assert not any(module.training for module in loftr.network.modules())


def test_the_features_are_the_picture(loftr, picture):
    found = loftr.features(picture)
    assert len(found) == 0
    assert found.size == (180, 260)
    assert found.image is picture


def test_matches_are_valid_and_the_same_each_time(loftr, picture):
    a, b = loftr.features(picture[:, :80, :96]), loftr.features(picture[:, :81, :99])
    matches, again = loftr.match(a, b), loftr.match(a, b)
    assert len(matches) > 0
    check_matches(matches, loftr)
    assert torch.equal(matches.points_b, again.points_b)
    assert not matches.points_b.requires_grad
    for points, size in ((matches.points_a, a.size), (matches.points_b, b.size)):
        assert (points >= 0).all()
        assert (points <= torch.tensor(size[::-1]) - 1).all()


def test_points_of_the_first_picture_lie_on_its_grid_half_a_pixel_back(loftr, picture):
    matches = loftr.match(loftr.features(picture[:, :80, :96]), loftr.features(picture[:, :80, :96]))
    assert len(matches) > 0
    assert ((matches.points_a + 0.5) % 8 == 0).all()
    # The corner of the first pixel is half a pixel before its centre.
    assert to_pixel_centres(torch.tensor([[0.0, 0.0], [8.0, 4.5]])).tolist() == [[-0.5, -0.5], [7.5, 4.0]]


def test_the_bound_on_the_confidence_holds(loftr, weights, picture):
    a, b = loftr.features(picture[:, :80, :96]), loftr.features(picture[:, :72, :104])
    every = loftr.match(a, b)
    bound = every.confidence.median().item()
    fewer = Loftr(min_confidence=bound, weights=weights).match(a, b)
    assert 0 < len(fewer) < len(every)
    assert (fewer.confidence > bound).all()


@pytest.mark.parametrize("size", [(1, 1), (2, 7), (16, 16), (20, 51)])
def test_any_picture_gives_finite_matches(size, loftr, picture):
    something, black = loftr.features(picture[:, :49, :55]), loftr.features(torch.zeros(3, *size))
    for a, b in ((black, black), (black, something), (something, black)):
        matches = loftr.match(a, b)
        assert matches.points_a.shape == matches.points_b.shape == (len(matches), 2)
        assert matches.points_b.isfinite().all()
        assert matches.confidence.isfinite().all()


def test_features_without_a_picture_are_an_error(loftr, picture):
    with pytest.raises(ValueError, match=r"Loftr\.features"):
        loftr.match(loftr.features(picture), no_features(0, (180, 260)))


def test_the_settings_name_the_weights(loftr, weights):
    assert {key: loftr.settings[key] for key in loftr.settings if "weights" not in key} == {"min_confidence": 0.0}
    check_identity(loftr.settings, Path(weights))


def test_missing_weights_are_one_sentence(tmp_path, monkeypatch):
    check_missing(Loftr, tmp_path, monkeypatch, "loftr/loftr_outdoor.ckpt", "zju3dv/LoFTR", "LoFTR('outdoor')")


def test_a_file_of_another_layout_is_one_sentence(tmp_path):
    with pytest.raises(UserError, match=r"^[^\n]*plain\.ckpt: holds no 'state_dict'[^\n]*$"):
        Loftr(weights=save({"model": {}}, tmp_path / "plain.ckpt"))


@pytest.mark.parametrize("value", [-0.1, 1.0])
def test_a_confidence_out_of_range_is_named(value):
    with pytest.raises(UserError, match=r"matcher\.min_confidence"):
        Loftr(min_confidence=value)


def test_the_configuration_holds_every_argument_with_its_default():
    check_arguments("loftr", Loftr)
