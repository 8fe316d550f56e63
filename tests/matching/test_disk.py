"""DISK's published weights are not here: random ones, in a file of the published layout, stand for them."""

from pathlib import Path

import kornia.feature
import pytest
import torch
from learned_checks import (
    check_any_size,
    check_arguments,
    check_features,
    check_identity,
    check_matches,
    check_missing,
    save,
)

from diffnav.errors import UserError
from diffnav.matching.disk import Disk


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    with torch.random.fork_rng():
        torch.manual_seed(0)
        extractor = kornia.feature.DISK().state_dict()
    return save({"extractor": extractor, "optimizer": {}}, tmp_path_factory.mktemp("disk") / "depth-save.pth")


@pytest.fixture(scope="module")
def disk(weights):
    return Disk(weights=weights)


def test_the_network_holds_the_files_weights(disk, weights):
    expected = torch.load(weights, weights_only=True)["extractor"]
    held = disk.network.state_dict()
    assert held.keys() == expected.keys()
    assert all(torch.equal(held[name], expected[name]) for name in expected)


@pytest.fixture
def small(picture):
    return picture[:, :90, :120]


def test_features_are_plain_and_the_same_each_time(disk, small):
    check_features(disk, small, 128, least=40)


def test_fewer_features_are_the_strongest(disk, weights, small):
    few = Disk(features=30, weights=weights).features(small)
    torch.testing.assert_close(few.scores, disk.features(small).scores[:30])


def test_keypoints_are_pixels_of_the_score_map(disk, picture):
    image = picture[:, :96, :128]
    found = disk.features(image)
    heat = disk.network.heatmap_and_dense_descriptors(image[None])[0][0, 0]
    x, y = found.keypoints.long().T
    torch.testing.assert_close(heat[y, x], found.scores)


def test_a_picture_matches_itself(disk, small):
    found = disk.features(small)
    matches = disk.match(found, found)
    assert len(matches) == len(found)
    assert torch.equal(matches.points_a, matches.points_b)
    torch.testing.assert_close(matches.confidence, torch.ones(len(matches)))
    check_matches(matches, disk)


def test_any_picture_gives_finite_features(disk):
    check_any_size(disk, 128)


def test_the_settings_name_the_weights(disk, weights):
    own = {"features": 500, "min_cosine": -1.0}
    assert {key: disk.settings[key] for key in disk.settings if "weights" not in key} == own
    check_identity(disk.settings, Path(weights))


def test_a_file_of_another_layout_is_one_sentence(tmp_path):
    with pytest.raises(UserError, match=r"^[^\n]*plain\.pth: holds no 'extractor'[^\n]*$"):
        Disk(weights=save(kornia.feature.DISK().state_dict(), tmp_path / "plain.pth"))


def test_missing_weights_are_one_sentence(tmp_path, monkeypatch):
    check_missing(Disk, tmp_path, monkeypatch, "disk/depth-save.pth", "cvlab-epfl/disk", "from_pretrained('depth')")


@pytest.mark.parametrize(("setting", "value"), [("features", 0), ("min_cosine", 1.5)])
def test_settings_out_of_range_are_named(setting, value):
    with pytest.raises(UserError, match=rf"matcher\.{setting}"):
        Disk(**{setting: value})


def test_the_configuration_holds_every_argument_with_its_default():
    check_arguments("disk", Disk)
