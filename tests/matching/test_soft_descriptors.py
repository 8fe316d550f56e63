"""Descriptors with gradients: what they follow, what they agree with, and that gradients reach the picture."""

import cv2
import numpy as np
import pytest
import torch
from hydra.utils import instantiate
from torch import Tensor
from torch.autograd import gradcheck

from conf.command import choice, choices
from diffnav.errors import UserError
from diffnav.geometry.frames import transfer_frames, upright_frames
from diffnav.geometry.views import draw_views, view_homography
from diffnav.matching.descriptors.soft_sift import SoftSift, cut_spikes, sample_patches
from diffnav.pretrained import pretrained_path

POINTS = torch.tensor([[[40.0, 40], [60, 52], [50, 70], [44, 58]]])


def scene(seed: int = 0, size: int = 96) -> Tensor:
    levels = np.random.default_rng(seed).random((size // 6, size // 6, 3)).astype(np.float32)
    return (
        torch.from_numpy(cv2.resize(levels, (size, size), interpolation=cv2.INTER_CUBIC))
        .permute(2, 0, 1)[None]
        .clamp(0, 1)
    )


def build(name: str):
    try:
        pretrained_path("xfeat/xfeat_backbone_from_onnx.pt", "")
    except UserError as error:
        if name != "soft_sift":
            pytest.skip(f"published weights are not here: {error}")
    return instantiate(choice("descriptor", name))


@pytest.mark.parametrize("name", choices("descriptor"))
def test_lengths_are_one_and_gradients_reach_the_picture(name: str) -> None:
    image = torch.cat([scene(0), scene(1)]).requires_grad_()
    frames = upright_frames(POINTS.expand(2, -1, -1), torch.full((2, 4), 12.0))
    described = build(name)(image, frames)
    assert described.shape[:2] == (2, 4)
    torch.testing.assert_close(described.norm(dim=2), torch.ones(2, 4), rtol=1e-3, atol=1e-3)
    (described[0, 0] * torch.randn(described.shape[2], generator=torch.Generator().manual_seed(0))).sum().backward()
    assert torch.isfinite(image.grad).all()
    assert image.grad[0].abs().sum() > 0
    assert image.grad[1].abs().sum() == 0


@pytest.mark.parametrize("name", choices("descriptor"))
def test_black_and_flat_pictures_are_finite(name: str) -> None:
    image = torch.stack([torch.zeros(3, 96, 96), torch.full((3, 96, 96), 0.5)]).requires_grad_()
    described = build(name)(image, upright_frames(POINTS.expand(2, -1, -1), torch.full((2, 4), 12.0)))
    described.sum().backward()
    assert torch.isfinite(described).all()
    assert torch.isfinite(image.grad).all()


@pytest.mark.parametrize("name", choices("descriptor"))
def test_what_follows_turns_finds_the_same_in_a_turned_view(name: str) -> None:
    descriptor = build(name)
    image = scene()
    H = view_homography((96, 96), 1.0, 1.1, tilt=(0.03, 0.0))[None]
    view = draw_views(image, H, (96, 96))
    frames = upright_frames(POINTS, torch.full((1, 4), 12.0))
    seen = transfer_frames(torch.linalg.inv(H), frames)
    agreement = (descriptor(image, frames) * descriptor(view, seen)).sum(2)[0]
    if descriptor.follows_turns:
        assert agreement.min() > 0.97
        others = descriptor(image, frames)[0] @ descriptor(view, seen)[0].T
        assert (others.argmax(1) == torch.arange(4)).all()
    else:
        assert agreement.mean() < 0.95


def test_patches_are_what_the_frames_cover() -> None:
    """A frame of 4 px around (10, 8), sampled to 8 x 8: the pixels' own values, half a pixel off the centre."""
    image = torch.arange(20.0 * 24).reshape(1, 1, 20, 24)
    patch = sample_patches(image, upright_frames(torch.tensor([[[10.0, 8]]]), torch.tensor([[4.0]])), 8)[0, 0, 0]
    expected = torch.tensor([[24 * (8 + j) + 10 + i for i in np.arange(-3.5, 4)] for j in np.arange(-3.5, 4)])
    torch.testing.assert_close(patch, expected.float(), rtol=1e-4, atol=1e-2)


def test_soft_sift_tells_points_apart_like_opencvs() -> None:
    """Distances between the points' descriptors correlate with those of OpenCV's SIFT at the same places."""
    image = scene(3)
    points = torch.tensor([[float(x), float(y)] for x in range(30, 67, 9) for y in range(30, 67, 9)])
    ours = SoftSift()(image, upright_frames(points[None], torch.full((1, len(points)), 12.0)))[0]
    grey = cv2.cvtColor((255 * image[0].permute(1, 2, 0)).round().byte().numpy(), cv2.COLOR_RGB2GRAY)
    # A keypoint of OpenCV's has a diameter; its cells are three of its scale wide, which is half of that.
    _, theirs = cv2.SIFT.create().compute(grey, [cv2.KeyPoint(x, y, 4.0, 0.0) for x, y in points.tolist()])
    theirs = torch.from_numpy(theirs).double()
    theirs = theirs / theirs.norm(dim=1, keepdim=True)
    off = ~torch.eye(len(points), dtype=torch.bool)
    pairs = torch.stack([(ours.double() @ ours.double().T)[off], (theirs @ theirs.T)[off]])
    assert torch.corrcoef(pairs)[0, 1] > 0.8


def test_xfeat_equals_kornias_dense_map() -> None:
    descriptor = build("xfeat")
    image = scene()
    with torch.no_grad():
        dense = descriptor.network(image)[0]
        # The centre of cell (x, y) of 8 x 8 pixels is at 8 x + 3.5.
        points = torch.tensor([[[8 * 5 + 3.5, 8 * 4 + 3.5], [8 * 7 + 3.5, 8 * 6 + 3.5]]])
        ours = descriptor(image, upright_frames(points, torch.ones(1, 2)))[0]
    theirs = torch.nn.functional.normalize(torch.stack([dense[0, :, 4, 5], dense[0, :, 6, 7]]), dim=1)
    torch.testing.assert_close(ours, theirs, rtol=1e-4, atol=1e-4)


def test_aliked_equals_kornias_own() -> None:
    descriptor = build("aliked")
    image = scene()
    with torch.no_grad():
        (found,) = descriptor.network(image)
        frames = upright_frames(found.keypoints[None, :20], torch.ones(1, 20))
        torch.testing.assert_close(descriptor(image, frames)[0], found.descriptors[:20], rtol=1e-3, atol=1e-4)


def test_spikes_are_cut_to_the_size_of_the_next() -> None:
    gradient = torch.cat([torch.zeros(50), torch.arange(1.0, 100), torch.tensor([-1e6])])
    cut = cut_spikes(gradient, 0.05)
    assert torch.equal(cut[:145], gradient[:145])
    assert cut[145:].tolist() == [95, 95, 95, 95, -95]
    assert torch.equal(cut_spikes(torch.zeros(3), 0.5), torch.zeros(3))


def test_gradients_are_those_of_finite_differences() -> None:
    image = scene(size=18).double().requires_grad_()
    frames = upright_frames(torch.tensor([[[9.0, 8]]]), torch.tensor([[6.0]])).double()
    assert gradcheck(SoftSift(patch_px=8, blur_px=1.0, spikes=0).double(), (image, frames))


@pytest.mark.parametrize("settings", [{"patch_px": 4}, {"blur_px": 0}, {"spikes": 1}])
def test_wrong_settings_are_refused(settings: dict) -> None:
    with pytest.raises(UserError):
        SoftSift(**settings)
