import math

import pytest
import torch
from matcher_checks import check_configuration, check_features, check_half_a_turn, check_nothing

from diffnav.errors import UserError
from diffnav.matching.rootsift import RootSift, root
from diffnav.matching.sift import Sift


def slow_root(descriptor):
    total = sum(descriptor)
    return [math.sqrt(value / total) for value in descriptor]


def test_descriptors_are_square_roots_of_the_shares():
    descriptors = torch.tensor([[1.0, 3, 0, 12], [2, 2, 2, 2]])
    expected = torch.tensor([slow_root(one) for one in descriptors.tolist()])
    torch.testing.assert_close(root(descriptors), expected)


def test_squared_distance_is_two_minus_two_hellinger_kernels():
    x, y = torch.rand(2, 128, generator=torch.Generator().manual_seed(1)).double()
    kernel = sum(math.sqrt(p * q) for p, q in zip((x / x.sum()).tolist(), (y / y.sum()).tolist(), strict=True))
    a, b = root(torch.stack([x, y]))
    assert (a - b).square().sum().item() == pytest.approx(2 - 2 * kernel, abs=1e-12)


def test_an_empty_histogram_stays_empty():
    assert root(torch.zeros(2, 4)).tolist() == [[0, 0, 0, 0]] * 2
    assert root(torch.zeros(0, 128)).shape == (0, 128)


def test_features_are_sifts_with_descriptors_of_length_one(picture):
    found, sift = RootSift().features(picture), Sift().features(picture)
    assert torch.equal(found.keypoints, sift.keypoints)
    assert torch.equal(found.scores, sift.scores)
    torch.testing.assert_close(found.descriptors.norm(dim=1), torch.ones(len(found)))
    one = 17
    torch.testing.assert_close(found.descriptors[one], torch.tensor(slow_root(sift.descriptors[one].tolist())))
    check_features(found, RootSift(features=40).features(picture), (180, 260), 128, torch.float32)


def test_a_picture_matches_itself_turned_upside_down(picture):
    check_half_a_turn(RootSift(), picture, least=150, within_px=0.1)


def test_an_empty_picture_has_no_features_and_no_matches(picture):
    check_nothing(RootSift(), picture, 128, torch.float32)


@pytest.mark.parametrize(("setting", "value"), [("features", 0), ("ratio", 0.0), ("mutual", None)])
def test_settings_out_of_range_are_named(setting, value):
    with pytest.raises(UserError, match=f"matcher.{setting}"):
        RootSift(**{setting: value})


def test_the_configuration_holds_every_argument_with_its_default():
    check_configuration("rootsift", RootSift)
