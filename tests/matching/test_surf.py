import pytest
import torch
from matcher_checks import check_configuration, check_features, check_half_a_turn, check_nothing

from diffnav.errors import UserError
from diffnav.matching.ground_truth import match_errors_px
from diffnav.matching.nearest import count_positions_once, nearest_neighbours
from diffnav.matching.surf import Surf


def levels(picture, least, most):
    """The picture in whole 8-bit levels from `least` to `most`."""
    return ((most - least) * picture + least).round() / 255


def test_features_are_the_strongest_first(picture):
    many, few = Surf().features(picture), Surf(features=40).features(picture)
    check_features(many, few, (180, 260), 64, torch.float32)
    assert len(few) == 40
    torch.testing.assert_close(few.scores, many.scores[:40])
    torch.testing.assert_close(many.descriptors.norm(dim=1), torch.ones(len(many)))


def test_a_blob_is_at_least_as_strong_as_the_threshold(picture):
    every, strong = Surf(features=5_000), Surf(features=5_000, threshold=0.0005)
    found = strong.features(picture)
    assert 0 < len(found) < len(every.features(picture))
    assert (found.scores > 0.0005).all()


def test_a_picture_matches_itself_turned_upside_down(picture):
    check_half_a_turn(Surf(), picture, least=250, within_px=0.1)


@pytest.mark.parametrize("extended", [False, True])
@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_quarter_turns_change_nothing(picture, quarters, extended):
    # The filters sample such a square alike from all four sides: 163 is 3 beyond a multiple of the coarsest step, 8.
    square = picture[:, :163, :163]
    surf = Surf(features=200, extended=extended)
    a, b = surf.features(square), surf.features(square.rot90(quarters, (1, 2)))
    x, y = a.keypoints.unbind(1)
    turned = {1: (y, 162 - x), 2: (162 - x, 162 - y), 3: (162 - y, x)}[quarters]
    matches = surf.match(a, b)
    assert len(matches) > 0.95 * len(a)
    distances, nearest = torch.cdist(torch.stack(turned, 1).double(), b.keypoints.double()).min(1)
    assert len(a) == len(b) > 150
    assert distances.max() < 1e-4
    torch.testing.assert_close(b.descriptors[nearest], a.descriptors, atol=1e-5, rtol=0)


def test_contrast_and_brightness_change_nothing_but_scores(picture):
    surf, grey = Surf(), levels(picture[:1], 0, 80).expand(3, -1, -1)
    faint, bright = surf.features(grey), surf.features(3 * grey + 12 / 255)
    assert len(faint) > 200
    torch.testing.assert_close(bright.keypoints, faint.keypoints, atol=1e-3, rtol=0)
    torch.testing.assert_close(bright.descriptors, faint.descriptors, atol=1e-4, rtol=0)
    torch.testing.assert_close(bright.scores, 9 * faint.scores, rtol=1e-4, atol=0)


def test_the_dark_has_as_many_features(picture):
    surf = Surf(features=200)
    day, night = surf.features(picture), surf.features(levels(picture, 0, 6))
    assert len(day) == len(night) == 200


def test_upright_descriptors_follow_a_shift_but_no_turn(picture):
    turned, upright = Surf(), Surf(upright=True)
    a, moved, quarter = picture[:, :150, :200], picture[:, 11:161, 7:207], picture[:, :150, :200].rot90(1, (1, 2))
    for surf in (turned, upright):
        matches = surf.match(surf.features(a), surf.features(moved))
        shift = torch.tensor([[1.0, 0, -7], [0, 1, -11], [0, 0, 1]])
        assert len(matches) > 100
        assert match_errors_px(matches, shift).median() < 0.3
    assert len(turned.match(turned.features(a), turned.features(quarter))) > 100
    assert len(upright.match(upright.features(a), upright.features(quarter))) < 10
    torch.testing.assert_close(upright.features(a).keypoints, turned.features(a).keypoints)


def test_ratio_and_mutual_check_are_obeyed(picture):
    a, b = picture[:, :150, :200], picture[:, 11:161, 7:207] ** 2
    counts = []
    for settings in ({"ratio": 0.5}, {}, {"ratio": 0.75, "mutual": False}, {"ratio": 1.0}):
        surf = Surf(**settings)
        one, other = surf.features(a), surf.features(b)
        chosen = {"ratio": 0.75, "mutual": True} | settings
        indices, confidence = nearest_neighbours(one.descriptors, other.descriptors, **chosen)
        indices, _ = count_positions_once(one, other, indices, confidence)
        matches = surf.match(one, other)
        torch.testing.assert_close(matches.points_a, one.keypoints[indices[:, 0]])
        torch.testing.assert_close(matches.points_b, other.keypoints[indices[:, 1]])
        counts.append(len(matches))
    assert 20 < counts[0] < counts[1] <= counts[2] < counts[3]


@pytest.mark.parametrize("extended", [False, True])
def test_an_empty_picture_has_no_features_and_no_matches(picture, extended):
    check_nothing(Surf(extended=extended), picture, 128 if extended else 64, torch.float32)


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("features", 0),
        ("ratio", 0.0),
        ("mutual", None),
        ("threshold", -0.1),
        ("threshold", "low"),
        ("octaves", 0),
        ("octaves", 9),
        ("octaves", 1.5),
        ("extended", 1),
        ("upright", "no"),
    ],
)
def test_settings_out_of_range_are_named(setting, value):
    with pytest.raises(UserError, match=f"matcher.{setting}"):
        Surf(**{setting: value})


def test_the_configuration_holds_every_argument_with_its_default():
    check_configuration("surf", Surf)
