import types
from dataclasses import replace

import cv2
import pytest
import torch
from matcher_checks import check_configuration, check_half_a_turn, check_nothing

from diffnav.errors import UserError
from diffnav.geometry.homography import rotate_180, rotation_180
from diffnav.matching import opencv_features
from diffnav.matching.ground_truth import correct_matches
from diffnav.matching.matches import Features
from diffnav.matching.orb import Orb
from diffnav.matching.orb_gms import OrbGms, checked_size


@pytest.fixture(scope="module")
def views(picture):
    """(upright, turned) features of one picture."""
    gms = OrbGms()
    return gms.features(picture), gms.features(rotate_180(picture))


def test_features_are_orbs(picture, views):
    orb = Orb().features(picture)
    for name in ("keypoints", "descriptors", "scores"):
        assert torch.equal(getattr(views[0], name), getattr(orb, name))


def test_a_picture_matches_itself_turned_upside_down(picture):
    check_half_a_turn(OrbGms(), picture, least=150, within_px=0.01)


def test_a_turned_picture_needs_the_rotation_flag(views):
    upright, turned = views
    assert len(OrbGms(rotation=False).match(turned, upright)) < len(OrbGms().match(turned, upright)) / 3
    assert len(OrbGms(rotation=False).match(upright, upright)) > 150


def test_confidence_is_the_share_of_agreeing_bits(views):
    upright, turned = views
    matches = OrbGms().match(turned, upright)
    rows = {tuple(p): d for p, d in zip(turned.keypoints.tolist(), turned.descriptors.tolist(), strict=True)}
    columns = {tuple(p): d for p, d in zip(upright.keypoints.tolist(), upright.descriptors.tolist(), strict=True)}
    for a, b, confidence in zip(matches.points_a, matches.points_b, matches.confidence.tolist(), strict=True):
        bits = [p ^ q for p, q in zip(rows[tuple(a.tolist())], columns[tuple(b.tolist())], strict=True)]
        assert confidence == pytest.approx(1 - sum(one.bit_count() for one in bits) / 256)


def test_a_higher_threshold_keeps_fewer(picture, views):
    noisy = (picture + 0.1 * torch.randn(picture.shape, generator=torch.Generator().manual_seed(4))).clamp(0, 1)
    query = OrbGms().features(rotate_180(noisy))
    counts = [len(OrbGms(threshold_factor=factor).match(query, views[0])) for factor in (1.0, 3.0, 6.0, 12.0)]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[-1]


def test_neighbours_drop_wrong_nearest_ones(picture, views):
    noisy = (picture + 0.25 * torch.randn(picture.shape, generator=torch.Generator().manual_seed(4))).clamp(0, 1)
    query = OrbGms().features(rotate_180(noisy))
    turn = rotation_180((180, 260))
    alone = Orb(ratio=1.0, mutual=False).match(query, views[0])
    supported = OrbGms(threshold_factor=3.0).match(query, views[0])
    assert len(supported) > 20
    share = correct_matches(supported, turn).float().mean()
    assert share > correct_matches(alone, turn).float().mean() + 0.2


def test_swapped_width_and_height_is_an_error(views):
    upright, turned = views
    swapped = replace(upright, size=(260, 180))
    for a, b in ((turned, swapped), (swapped, turned)):
        with pytest.raises(ValueError, match=r"outside of its image, 180 wide and 260 high.*\(height, width\)"):
            OrbGms().match(a, b)
    with pytest.raises(ValueError, match="outside of its image"):
        OrbGms().match(swapped, replace(upright, keypoints=upright.keypoints[:0], descriptors=upright.descriptors[:0]))


@pytest.mark.parametrize(
    ("point", "inside"), [((0, 0), True), ((9.99, 4.99), True), ((10, 2), False), ((2, 5), False), ((-0.1, 2), False)]
)
def test_inside_is_from_nothing_to_below_the_size(point, inside):
    features = Features(torch.tensor([point]).float(), torch.zeros(1, 32), torch.zeros(1), (5, 10))
    if inside:
        assert checked_size(features) == (10, 5)
    else:
        with pytest.raises(ValueError, match="outside"):
            checked_size(features)


def test_pictures_of_different_sizes_match(picture, views):
    part = picture[:, 20:160, 30:250]
    matches = OrbGms().match(OrbGms().features(part), views[0])
    shift = torch.tensor([[1.0, 0, 30], [0, 1, 20], [0, 0, 1]])
    assert len(matches) > 50
    assert correct_matches(matches, shift).float().mean() > 0.85


def test_an_empty_picture_has_no_features_and_no_matches(picture):
    check_nothing(OrbGms(), picture, 32, torch.uint8)


def test_without_contrib_one_sentence_names_the_package(monkeypatch):
    monkeypatch.setattr(opencv_features, "cv2", types.SimpleNamespace(__version__=cv2.__version__))
    with pytest.raises(UserError, match=r"has no matchGMS: .*opencv-contrib-python-headless"):
        OrbGms()


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("features", 0),
        ("rotation", "yes"),
        ("scale", 1),
        ("threshold_factor", -1.0),
        ("threshold_factor", float("nan")),
    ],
)
def test_settings_out_of_range_are_named(setting, value):
    with pytest.raises(UserError, match=f"matcher.{setting}"):
        OrbGms(**{setting: value})


def test_the_configuration_holds_every_argument_with_its_default():
    check_configuration("orb_gms", OrbGms)
