import inspect

import cv2
import pytest
import torch
from hydra.utils import instantiate

from conf.command import choice
from diffnav.errors import UserError
from diffnav.geometry.homography import rotate_180, rotation_180
from diffnav.matching import nearest
from diffnav.matching.ground_truth import correct_matches, match_errors_px
from diffnav.matching.matches import Features, Matches
from diffnav.matching.nearest import count_positions_once, nearest_neighbours
from diffnav.matching.sift import Sift


def features_of(keypoints, descriptors=None):
    points = torch.tensor(keypoints, dtype=torch.float32)
    if descriptors is None:
        descriptors = torch.zeros(len(points), 2)
    return Features(points, descriptors, torch.ones(len(points)), (100, 100))


def matches_of(points_a, points_b):
    a, b = (torch.tensor(p, dtype=torch.float32) for p in (points_a, points_b))
    return Matches(a, b, torch.ones(len(a)), "by hand", {})


def test_features_are_the_strongest_first_and_at_most_as_many_as_asked_for(picture):
    many, few = Sift(features=500).features(picture), Sift(features=40).features(picture)
    assert 200 < len(many) <= 500
    assert len(few) == 40
    assert many.keypoints.shape == (len(many), 2)
    assert many.descriptors.shape == (len(many), 128)
    assert many.size == (180, 260)
    assert (many.scores.diff() <= 0).all()
    torch.testing.assert_close(few.scores, many.scores[:40])
    assert (many.keypoints >= 0).all()
    assert (many.keypoints < torch.tensor([260, 180])).all()


@pytest.mark.parametrize("centre", [(70.0, 40.0), (59.5, 40.5), (63.25, 51.8)])
@pytest.mark.parametrize("sigma", [2.5, 5.0, 8.0])
def test_an_ideal_blob_is_found_at_its_centre(centre, sigma):
    # OpenCV's default upscaling puts it .25 px away in x and y.
    y, x = torch.meshgrid(torch.arange(100.0), torch.arange(120.0), indexing="ij")
    blob = torch.exp(-((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / (2 * sigma**2)).expand(3, -1, -1)
    strongest = Sift().features(blob).keypoints[0]
    torch.testing.assert_close(strongest, torch.tensor(centre), atol=0.06, rtol=0)


def test_a_picture_matches_itself_turned_upside_down(picture):
    sift = Sift()
    matches = sift.match(sift.features(rotate_180(picture)), sift.features(picture))
    correct = correct_matches(matches, rotation_180((180, 260)))
    assert len(matches) > 150
    assert correct.float().mean() > 0.97
    assert matches.matcher == "sift"
    assert matches.settings == {"features": 500, "ratio": 0.75, "mutual": True}
    assert ((matches.confidence > 0.25) & (matches.confidence <= 1)).all()


def test_no_position_counts_twice_though_keypoints_have_several_orientations(picture):
    sift = Sift()
    a, b = sift.features(picture), sift.features(rotate_180(picture))
    assert len({tuple(p) for p in a.keypoints.tolist()}) < len(a)
    matches = sift.match(a, b)
    for points in (matches.points_a, matches.points_b):
        assert len({tuple(p) for p in points.tolist()}) == len(points)


def test_unrelated_pictures_hardly_match(picture):
    sift = Sift()
    noise = torch.rand(3, 180, 260, generator=torch.Generator().manual_seed(8))
    assert len(sift.match(sift.features(noise), sift.features(picture))) < 10


@pytest.mark.parametrize("size", [(1, 1), (2, 7), (16, 16), (120, 90)])
def test_an_empty_picture_has_no_features_and_no_matches(size, picture):
    sift = Sift()
    nothing = sift.features(torch.zeros(3, *size))
    assert len(nothing) == 0
    assert nothing.descriptors.shape == (0, 128)
    something = sift.features(picture)
    for a, b in ((nothing, nothing), (nothing, something), (something, nothing)):
        matches = sift.match(a, b)
        assert len(matches) == 0
        assert matches.points_a.shape == matches.points_b.shape == (0, 2)
        assert correct_matches(matches, rotation_180(size)).shape == (0,)


def test_nearest_neighbours_are_those_of_opencv(picture):
    sift = Sift()
    a, b = sift.features(rotate_180(picture)), sift.features(picture)
    forth = cv2.BFMatcher().knnMatch(a.descriptors.numpy(), b.descriptors.numpy(), k=2)
    back = cv2.BFMatcher().match(b.descriptors.numpy(), a.descriptors.numpy())
    expected = {
        (m.queryIdx, m.trainIdx): 1 - m.distance / n.distance
        for m, n in forth
        if m.distance < 0.75 * n.distance and back[m.trainIdx].trainIdx == m.queryIdx
    }
    indices, confidence = nearest_neighbours(a.descriptors, b.descriptors, 0.75, mutual=True)
    found = dict(zip(map(tuple, indices.tolist()), confidence.tolist(), strict=True))
    assert found.keys() == expected.keys()
    assert found == pytest.approx(expected, abs=1e-4)


def test_blocks_of_rows_change_nothing(monkeypatch):
    """Every a in turn: the nearest a of each b must be found across blocks, the first of equals."""
    monkeypatch.setattr(nearest, "_ROWS", 2)
    a = torch.tensor([[0.0], [5.0], [9.0], [5.0], [1.0]])
    b = torch.tensor([[5.2], [0.6], [8.0]])
    # b0's nearest are a1 and a3, equally near; b1's is a4 (.4 against a0's .6); b2's is a2.
    indices, confidence = nearest_neighbours(a, b, ratio=1, mutual=True)
    assert indices.tolist() == [[1, 0], [2, 2], [4, 1]]
    assert confidence.tolist() == pytest.approx([1 - 0.2 / 3.0, 1 - 1.0 / 3.8, 1 - 0.4 / 4.2], abs=1e-5)


def test_ratio_test_and_mutual_check_by_hand():
    a = torch.tensor([[0.0, 0.0], [10.0, 0.0], [0.4, 0.0]])
    b = torch.tensor([[0.1, 0.0], [13.0, 0.0], [10.0, 4.0]])
    # a0 -> b0 (.1, next 10.0); a1 -> b1 (3, next 4: ratio .75); a2 -> b0 (.3, next 10.4), but b0's nearest is a0.
    assert nearest_neighbours(a, b, ratio=1, mutual=False)[0].tolist() == [[0, 0], [1, 1], [2, 0]]
    assert nearest_neighbours(a, b, ratio=1, mutual=True)[0].tolist() == [[0, 0], [1, 1]]
    assert nearest_neighbours(a, b, ratio=0.76, mutual=True)[0].tolist() == [[0, 0], [1, 1]]
    indices, confidence = nearest_neighbours(a, b, ratio=0.74, mutual=True)
    assert indices.tolist() == [[0, 0]]
    assert confidence.tolist() == pytest.approx([1 - 0.1 / 116**0.5], abs=1e-3)


def test_one_candidate_passes_no_ratio_test():
    a, b = torch.tensor([[0.0, 1.0]]), torch.tensor([[0.0, 1.0]])
    assert len(nearest_neighbours(a, b, ratio=0.75)[0]) == 0
    assert nearest_neighbours(a, b, ratio=1.0)[0].tolist() == [[0, 0]]


def test_two_equal_candidates_are_ambiguous():
    a, b = torch.tensor([[1.0, 2.0]]), torch.tensor([[1.0, 2.0], [1.0, 2.0]])
    assert len(nearest_neighbours(a, b, ratio=0.75)[0]) == 0
    assert nearest_neighbours(a, b, ratio=1.0, mutual=False)[1].tolist() == [0]


def test_of_matches_at_one_position_the_most_confident_stays():
    a = features_of([[5, 5], [5, 5], [9, 9], [7, 7]])
    b = features_of([[1, 1], [2, 2], [3, 3], [3, 3]])
    indices = torch.tensor([[0, 0], [1, 1], [2, 2], [3, 3]])
    kept, confidence = count_positions_once(a, b, indices, torch.tensor([0.3, 0.8, 0.4, 0.6]))
    assert kept.tolist() == [[1, 1], [3, 3]]
    assert confidence.tolist() == pytest.approx([0.8, 0.6])


def test_points_in_one_pixel_are_one_position():
    a = features_of([[5.0, 5.0], [5.4, 4.6], [5.6, 5.0]])
    b = features_of([[1.0, 1.0], [20.0, 2.0], [30.0, 3.0]])
    kept, _ = count_positions_once(a, b, torch.tensor([[0, 0], [1, 1], [2, 2]]), torch.tensor([0.3, 0.8, 0.4]))
    assert kept.tolist() == [[1, 1], [2, 2]]


def test_errors_and_the_threshold_by_hand():
    matches = matches_of([[0, 0], [10, 10], [20, 5], [0, 0]], [[99, 49], [92, 39], [76, 48], [99, 46.01]])
    turn = rotation_180((50, 100))
    assert match_errors_px(matches, turn).tolist() == pytest.approx([0, 3, 5, 2.99], abs=1e-5)
    assert correct_matches(matches, turn).tolist() == [True, True, False, True]
    assert correct_matches(matches, turn, threshold_px=5).tolist() == [True] * 4
    assert correct_matches(matches, turn, threshold_px=0.5).tolist() == [True, False, False, False]


def test_a_point_beyond_the_horizon_is_wrong_not_an_error():
    horizon = torch.tensor([[1.0, 0, 0], [0, 1, 0], [0.01, 0, -1]], dtype=torch.float64)
    assert correct_matches(matches_of([[100, 5]], [[100, 5]]), horizon).tolist() == [False]


@pytest.mark.parametrize(
    ("setting", "value"),
    [("features", 0), ("features", 2.5), ("features", "many"), ("ratio", 0.0), ("ratio", 1.5), ("mutual", "no")],
)
def test_settings_out_of_range_are_named(setting, value):
    with pytest.raises(UserError, match=f"matcher.{setting}"):
        Sift(**{setting: value})


def test_the_configuration_holds_every_argument_with_its_default():
    cfg = choice("matcher", "sift")
    defaults = {name: p.default for name, p in inspect.signature(Sift).parameters.items()}
    assert {key: value for key, value in cfg.items() if key != "_target_"} == defaults
    assert instantiate(cfg).settings == defaults
