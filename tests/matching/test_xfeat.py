from pathlib import Path

import pytest
import torch
from learned_checks import (
    check_any_size,
    check_arguments,
    check_features,
    check_identity,
    check_missing,
    check_moved,
    need,
)
from torch.nn.functional import interpolate

from diffnav.errors import UserError
from diffnav.matching.xfeat import XFeat, to_pixel_centres
from diffnav.pretrained import pretrained_path

FILE = "xfeat/xfeat_backbone_from_onnx.pt"


@pytest.fixture(scope="module")
def xfeat():
    need(FILE)
    return XFeat()


def test_features_are_plain_and_the_same_each_time(xfeat, picture):
    found = check_features(xfeat, picture, 64, least=200)
    few = XFeat(features=40).features(picture)
    assert torch.equal(few.keypoints, found.keypoints[:40])


@pytest.mark.parametrize("size", [(63, 95), (180, 260), (128, 160), (33, 127)])
def test_keypoints_lie_where_the_resized_picture_shows_them(xfeat, picture, size):
    small = picture[:, : size[0], : size[1]]
    seen = [side // 32 * 32 for side in size]
    resized = interpolate(small[None], seen, mode="bilinear", align_corners=False)[0]
    within = xfeat.features(resized).keypoints
    assert len(within) > 5
    # A pixel's centre, counted from the picture's corner, keeps its share of the side.
    scale = torch.tensor([size[1] / seen[1], size[0] / seen[0]])
    torch.testing.assert_close(xfeat.features(small).keypoints, (within + 0.5) * scale - 0.5)


def test_the_middle_stays_the_middle():
    middle_of_resized = torch.tensor([[(576 - 1) / 2, (384 - 1) / 2]])
    reported = middle_of_resized * torch.tensor([600 / 576, 400 / 384])
    torch.testing.assert_close(to_pixel_centres(reported, (400, 600)), torch.tensor([[299.5, 199.5]]))
    assert torch.equal(to_pixel_centres(middle_of_resized, (384, 576)), middle_of_resized)


def test_a_picture_moved_by_whole_cells_matches_without_offset(xfeat, picture):
    check_moved(xfeat, picture[:, :160, :256], offset=(32, 32), least=60)


def test_only_similar_descriptors_match(xfeat, picture):
    noise = torch.rand(3, 180, 260, generator=torch.Generator().manual_seed(8))
    a, b = xfeat.features(noise), xfeat.features(picture)
    matches = xfeat.match(a, b)
    assert (matches.confidence > 0.82).all()
    assert len(XFeat(min_cosine=-1).match(a, b)) > len(matches)


def test_any_picture_gives_finite_features(xfeat):
    check_any_size(xfeat, 64)


def test_the_settings_name_the_weights(xfeat):
    own = {"features": 500, "detection_threshold": 0.05, "min_cosine": 0.82}
    assert {key: xfeat.settings[key] for key in xfeat.settings if "weights" not in key} == own
    check_identity(xfeat.settings, pretrained_path(FILE, ""))


def test_other_weights_are_one_sentence():
    need(FILE, "aliked/aliked-n16.pth")
    with pytest.raises(UserError, match=r"^[^\n]*aliked-n16\.pth: not the weights of this network[^\n]*$"):
        XFeat(weights=str(Path(pretrained_path("aliked/aliked-n16.pth", "")).resolve()))


def test_missing_weights_are_one_sentence(tmp_path, monkeypatch):
    check_missing(XFeat, tmp_path, monkeypatch, FILE, "accelerated_features", "DIFFNAV_WEIGHTS")


@pytest.mark.parametrize(("setting", "value"), [("features", 0), ("min_cosine", 2), ("detection_threshold", -0.1)])
def test_settings_out_of_range_are_named(setting, value):
    with pytest.raises(UserError, match=rf"matcher\.{setting}"):
        XFeat(**{setting: value})


def test_the_configuration_holds_every_argument_with_its_default():
    check_arguments("xfeat", XFeat)
