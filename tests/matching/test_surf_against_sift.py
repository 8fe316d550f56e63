"""SURF beside OpenCV's SIFT on photographs: rotated aerial pictures, and graf and boat of the Oxford set."""

import time
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from diffnav.images import read_image
from diffnav.matching.ground_truth import correct_matches
from diffnav.matching.sift import Sift
from diffnav.matching.surf import Surf

AERIAL = Path("../shared/data/aerial/train")
OXFORD = Path("../shared/data/hpatches/oxford")
SHARE = 0.7  # of SIFT's correct matches


def turned(image, angle_deg):
    """The image turned about its centre, black where nothing is, and the homography (3, 3) to it."""
    height, width = image.shape[1:]
    turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), angle_deg, 1)
    picture = cv2.warpAffine(np.ascontiguousarray(image.permute(1, 2, 0).numpy()), turn, (width, height))
    H = torch.eye(3, dtype=torch.float64)
    H[:2] = torch.from_numpy(turn)
    return torch.from_numpy(picture.transpose(2, 0, 1).copy()).clamp(0, 1), H


def correct(image, others):
    """Correct matches, SURF's and SIFT's (2, N), of an image with others, each given with the homography to it."""
    counts = []
    for matcher in (Surf(), Sift()):
        of_image = matcher.features(image)
        matches = [(matcher.match(of_image, matcher.features(other)), H) for other, H in others]
        counts.append([int(correct_matches(found, H).sum()) for found, H in matches])
    return np.array(counts)


def check_angles(names, angles):
    images = [read_image(name) for name in names]
    surf, sift = sum(correct(image, [turned(image, angle) for angle in angles]) for image in images)
    assert (sift > 50 * len(names)).all()
    assert (surf >= SHARE * sift).all(), f"correct at {list(angles)} degrees: {surf} of SIFT's {sift}"


@pytest.mark.skipif(not AERIAL.is_dir(), reason=f"no {AERIAL}")
def test_rotated_aerial_pictures_match_nearly_as_with_sift():
    # The worst angles; one picture of each source.
    names = [AERIAL / f"{name}.jpg" for name in ("copr_dunes_003", "lewis_park_005", "palm_plantation_002")]
    check_angles(names, (45, 75, 105))


@pytest.mark.slow
@pytest.mark.skipif(not AERIAL.is_dir(), reason=f"no {AERIAL}")
def test_aerial_pictures_match_nearly_as_with_sift_at_every_angle():
    names = sorted(path for path in AERIAL.iterdir() if path.name.startswith(("copr", "lewis", "palm")))
    assert len(names) == 30
    check_angles(names, range(0, 181, 15))


@pytest.mark.skipif(not OXFORD.is_dir(), reason=f"no {OXFORD}")
@pytest.mark.parametrize(("sequence", "last"), [("graf", 3), ("boat", 3)])
def test_turned_zoomed_and_slanted_pictures_match_nearly_as_with_sift(sequence, last):
    folder = OXFORD / sequence
    others = [
        (read_image(folder / f"img{k}.jpg"), torch.from_numpy(np.loadtxt(folder / f"H1to{k}p")))
        for k in range(2, last + 1)
    ]
    surf, sift = correct(read_image(folder / "img1.jpg"), others).sum(1)
    assert surf >= SHARE * sift


@pytest.mark.slow
def test_500_features_take_at_most_150_ms_of_one_core():
    dice = torch.Generator().manual_seed(1)
    rough = torch.rand(1, 3, 100, 150, generator=dice)
    image = torch.nn.functional.interpolate(rough, size=(400, 600), mode="bilinear")[0]
    surf = Surf()
    seconds = []
    for _ in range(5):
        start = time.process_time()
        assert len(surf.features(image)) == 500
        seconds.append(time.process_time() - start)
    assert min(seconds) <= 0.15
