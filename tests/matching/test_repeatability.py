"""Repeatability by hand and against slow loops."""

import torch

from diffnav.geometry.homography import apply_homography
from diffnav.geometry.views import view_homography
from diffnav.matching.matches import Features
from diffnav.matching.repeatability import are_visible, repeatability


def features_of(points, size=(100, 100)):
    keypoints = torch.tensor(points, dtype=torch.float32).reshape(-1, 2)
    return Features(keypoints, torch.zeros(len(keypoints), 2), torch.ones(len(keypoints)), size)


def shift(x, y):
    H = torch.eye(3, dtype=torch.float64)
    H[0, 2], H[1, 2] = x, y
    return H


def test_by_hand():
    # Moved by 10: a's points lie at (30, 20), (60, 50), (105, 5) in b; the last is outside.
    a = features_of([[20, 20], [50, 50], [95, 5]])
    # (30, 22) is 2 px from the first; (60, 54) is 4 px from the second; (5, 90) comes from x = -5, outside of a.
    b = features_of([[30, 22], [60, 54], [5, 90]])
    assert repeatability(a, b, shift(10, 0)) == 2 / 4
    assert repeatability(a, b, shift(10, 0), threshold_px=4) == 4 / 4


def test_what_is_not_visible_does_not_count():
    a, b = features_of([[20, 20], [50, 50]]), features_of([[20, 20], [50, 54]])
    visible = torch.ones(100, 100, dtype=torch.bool)
    visible[45:60] = False
    assert repeatability(a, b, torch.eye(3)) == 2 / 4
    assert repeatability(a, b, torch.eye(3), visible) == 2 / 2


def test_several_orientations_of_a_keypoint_are_one():
    a, b = features_of([[20, 20], [20, 20], [20, 20], [70, 70]]), features_of([[20, 20], [40, 40]])
    assert repeatability(a, b, torch.eye(3)) == 2 / 4


def test_nothing_to_repeat_is_no_figure_and_nothing_repeated_is_zero():
    none, some = features_of([]), features_of([[5, 5]])
    assert repeatability(none, none, torch.eye(3)) is None
    assert repeatability(none, some, torch.eye(3)) == 0
    assert repeatability(some, some, shift(99, 0)) is None


def test_against_a_slow_loop():
    dice = torch.Generator().manual_seed(2)
    a = features_of((torch.rand(60, 2, generator=dice) * 99).tolist())
    b = features_of((torch.rand(80, 2, generator=dice) * torch.tensor([79.0, 59.0])).tolist(), (60, 80))
    H = view_homography((100, 100), 0.4, 0.8, (-9.0, -18.0), (0.1, 0.05))
    counted, repeated = 0, 0
    for here, there, matrix, size, forth in ((a, b, H, b.size, True), (b, a, H.inverse(), a.size, False)):
        for point in here.keypoints:
            x, y = apply_homography(matrix, point[None])[0].tolist()
            if 0 <= x <= size[1] - 1 and 0 <= y <= size[0] - 1:
                counted += 1
                if forth:
                    nearest = (there.keypoints - torch.tensor([x, y])).norm(dim=1).min()
                else:
                    nearest = (apply_homography(H, there.keypoints) - point).norm(dim=1).min()
                repeated += nearest.item() <= 3
    assert 0 < repeated < counted
    assert repeatability(a, b, H) == repeated / counted


def test_visibility_is_that_of_the_nearest_pixel():
    visible = torch.zeros(4, 5, dtype=torch.bool)
    visible[2, 3] = True
    points = torch.tensor([[3.4, 1.6], [3.6, 2.0], [3.0, 2.0], [-1.0, 2.0], [3.0, 7.0]])
    assert are_visible(points, visible).tolist() == [True, False, True, False, False]
    assert are_visible(points, None).all()
