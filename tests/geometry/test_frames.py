"""Local affine frames: how a homography carries them, and how far they reach."""

import math

import torch

from diffnav.geometry.frames import frame_reach_px, transfer_frames, upright_frames
from diffnav.geometry.homography import apply_homography
from diffnav.geometry.views import view_homography

KEYPOINTS = torch.tensor([[[30.0, 40], [55.5, 20]]])


def test_a_turn_turns_and_a_zoom_shrinks() -> None:
    H = torch.linalg.inv(view_homography((96, 96), math.radians(30), 2.0))[None]
    frames = transfer_frames(H, upright_frames(KEYPOINTS, torch.tensor([[4.0, 6]])))
    c, s = math.cos(math.radians(30)) / 2, math.sin(math.radians(30)) / 2
    expected = torch.tensor([[c, s], [-s, c]])
    torch.testing.assert_close(frames[0, 0, :, :2], 4 * expected)
    torch.testing.assert_close(frames[0, 1, :, :2], 6 * expected)
    torch.testing.assert_close(frames[..., 2], apply_homography(H, KEYPOINTS).float())


def test_under_perspective_it_is_the_derivative() -> None:
    H = view_homography((96, 96), 0.7, 1.2, (3.0, 1.0), (0.2, -0.1))[None]
    frames = transfer_frames(H, upright_frames(KEYPOINTS.double(), torch.ones(1, 2, dtype=torch.float64)))
    step = 1e-5
    for axis in (0, 1):
        moved = KEYPOINTS.double().clone()
        moved[..., axis] += step
        derivative = (apply_homography(H, moved) - apply_homography(H, KEYPOINTS)) / step
        torch.testing.assert_close(frames[..., axis], derivative, rtol=1e-4, atol=1e-5)


def test_reach_is_that_of_the_ellipse() -> None:
    frames = torch.tensor([[[[3.0, 4, 10], [0, 2, 20]]]])
    angles = torch.linspace(0, 2 * math.pi, 10_000)
    circle = torch.stack([angles.cos(), angles.sin()])
    largest = (frames[0, 0, :, :2] @ circle).amax(1)
    torch.testing.assert_close(frame_reach_px(frames)[0, 0], largest, rtol=1e-5, atol=1e-5)
