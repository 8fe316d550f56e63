"""Pictures as a whole: length, contrast, directions of edges, and who is most like whom."""

import numpy as np
import pytest
import torch
from torch import Tensor

from diffnav.driving.shortlist import most_alike, picture_descriptor


def waves(seed: int, size: tuple[int, int] = (96, 192)) -> Tensor:
    """(3, h, w) smooth structure in [.2, .8], one colour differently from the next."""
    dice = np.random.default_rng(seed)
    y, x = np.mgrid[: size[0], : size[1]] / size[1]
    layers = [
        sum(np.sin(2 * np.pi * (dice.uniform(-9, 9) * x + dice.uniform(-9, 9) * y) + dice.uniform(0, 6)) for _ in "abc")
        for _ in "rgb"
    ]
    return torch.from_numpy(np.stack(layers) / 10 + 0.5).float()


def angle_deg(a: Tensor, b: Tensor) -> float:
    cosine = float(picture_descriptor(a) @ picture_descriptor(b))
    return float(np.degrees(np.arccos(min(cosine, 1.0))))


def test_of_length_one_with_every_block() -> None:
    """Blocks of 16 px every 8 px in 128 x 64: 15 x 7, of four cells with nine directions each."""
    for size in ((96, 192), (40, 33), (2056 // 8, 2452 // 8)):
        descriptor = picture_descriptor(waves(1, size))
        assert (descriptor.shape, descriptor.dtype) == ((15 * 7 * 4 * 9,), np.float32)
        assert np.linalg.norm(descriptor) == pytest.approx(1, abs=1e-5)


def test_a_flat_picture_has_none() -> None:
    for level in (0.0, 0.4, 1.0):
        assert not picture_descriptor(torch.full((3, 50, 70), level)).any()


def test_contrast_and_brightness_do_not_count() -> None:
    picture = waves(2)
    assert angle_deg(picture, picture * 0.5 + 0.3) < 10
    # Size hardly does.
    assert angle_deg(picture, picture.repeat_interleave(2, 1).repeat_interleave(2, 2)) < 10
    assert angle_deg(picture, waves(3)) > 25


@pytest.mark.parametrize(("along", "bins"), [("x", (0, 8)), ("y", (4, 4))])
def test_directions_of_edges(along: str, bins: tuple[int, int]) -> None:
    """Brightness that changes along x has gradients at 0 degrees, between the bins around 10 and 170; along y at 90."""
    y, x = torch.meshgrid(torch.arange(64), torch.arange(128), indexing="ij")
    picture = (0.5 + 0.4 * torch.sin((x if along == "x" else y) / 3.0)).expand(3, -1, -1)
    energy = (picture_descriptor(picture).reshape(-1, 9) ** 2).sum(0)
    assert energy[list(set(bins))].sum() > 0.98 * energy.sum()


def test_the_most_alike_first_and_the_earlier_of_equals() -> None:
    references = np.array([[0.0, 1.0], [1.0, 0.0], [0.6, 0.8], [1.0, 0.0], [-1.0, 0.0]], np.float32)
    query = np.array([1.0, 0.0], np.float32)
    assert most_alike(query, references, 9) == [1, 3, 2, 0, 4]
    assert most_alike(query, list(references), 3) == [1, 3, 2]
    assert most_alike(query, references, 0) == []


def test_a_picture_finds_itself_after_it_was_darkened() -> None:
    pictures = [waves(seed) for seed in range(12)]
    references = np.stack([picture_descriptor(one) for one in pictures])
    for k, picture in enumerate(pictures):
        dark = ((picture**2) * 255).round() / 255
        found = most_alike(picture_descriptor(dark), references, 3)
        assert found[0] == k
        assert len(set(found)) == 3
