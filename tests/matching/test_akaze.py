import types

import cv2
import pytest
import torch
from matcher_checks import check_configuration, check_features, check_half_a_turn, check_nothing

from diffnav.errors import UserError
from diffnav.matching import opencv_features
from diffnav.matching.akaze import Akaze


def test_features_are_the_strongest_first(picture):
    many = Akaze(threshold=1e-4).features(picture)
    few = Akaze(features=40, threshold=1e-4).features(picture)
    check_features(many, few, (180, 260), 61, torch.uint8)
    torch.testing.assert_close(few.scores, many.scores[:40])


def test_a_corner_is_at_least_as_strong_as_the_threshold(picture):
    dark = picture / 4
    assert len(Akaze().features(dark)) < 50
    found = Akaze(threshold=1e-5).features(dark)
    assert len(found) > 200
    assert (found.scores >= 1e-5).all()


@pytest.mark.parametrize("centre", [(70.0, 40.0), (59.4, 40.6), (63.25, 51.8)])
def test_an_ideal_blob_is_found_at_its_centre(centre):
    y, x = torch.meshgrid(torch.arange(100.0), torch.arange(120.0), indexing="ij")
    blob = torch.exp(-((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / (2 * 4**2)).expand(3, -1, -1)
    distances = (Akaze(threshold=1e-5).features(blob).keypoints - torch.tensor(centre)).norm(dim=1)
    assert distances.min() < 0.05


def test_a_picture_matches_itself_turned_upside_down(picture):
    check_half_a_turn(Akaze(threshold=1e-4), picture, least=150, within_px=0.01)


def test_an_empty_picture_has_no_features_and_no_matches(picture):
    check_nothing(Akaze(), picture, 61, torch.uint8)


@pytest.mark.parametrize("home", ["top level", "xfeatures2d"])
def test_both_homes_of_akaze_are_known(home, monkeypatch):
    """OpenCV 4 has it at the top level, OpenCV 5 in contrib's xfeatures2d."""
    there = types.SimpleNamespace(AKAZE="found")
    version = there if home == "top level" else types.SimpleNamespace(xfeatures2d=there)
    monkeypatch.setattr(opencv_features, "cv2", version)
    assert opencv_features.from_contrib("AKAZE") == "found"


def test_without_contrib_one_sentence_names_the_package(monkeypatch):
    monkeypatch.setattr(opencv_features, "cv2", types.SimpleNamespace(__version__=cv2.__version__))
    with pytest.raises(UserError, match=r"has no AKAZE: .*opencv-contrib-python-headless"):
        Akaze()


@pytest.mark.parametrize(
    ("setting", "value"),
    [("features", 0), ("threshold", 0.0), ("threshold", 1.0), ("threshold", "low"), ("ratio", 2.0), ("mutual", "no")],
)
def test_settings_out_of_range_are_named(setting, value):
    with pytest.raises(UserError, match=f"matcher.{setting}"):
        Akaze(**{setting: value})


def test_the_configuration_holds_every_argument_with_its_default():
    check_configuration("akaze", Akaze)
    check_configuration("akaze_low", Akaze, threshold=1e-5)
