"""What the matchers on OpenCV's detectors share: their keypoints as `Features`, and the parts that need contrib."""

from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import Any

import cv2
import numpy as np
import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.images import to_uint8
from diffnav.matching.matches import Features


def detect_features(
    detector: Any,
    image: Tensor,
    most: int,
    position: Callable[[cv2.KeyPoint], Sequence[float]] = attrgetter("pt"),
    least_px: int = 1,
) -> Features:
    """At most `most` features of an image (3, H, W) in [0, 1], the strongest first; perhaps none.

    Args:
        detector: a cv2.Feature2D; it sees the grey picture in 8 bit.
        most: OpenCV keeps ties beyond it; they are cut here.
        position: x, y of a keypoint in pixels of the image.
        least_px: an image with a shorter side has none, and the detector, which may fail on it, does not see it.
    Returns: descriptors as wide as the detector's, float32 or uint8 (binary).
    """
    size = (image.shape[1], image.shape[2])
    found: Sequence[cv2.KeyPoint] = ()
    descriptors = None
    if min(size) >= least_px:
        found, descriptors = detector.detectAndCompute(cv2.cvtColor(to_uint8(image), cv2.COLOR_RGB2GRAY), None)
    if descriptors is None:
        kind = np.uint8 if detector.descriptorType() == cv2.CV_8U else np.float32
        descriptors = np.zeros((0, detector.descriptorSize()), kind)
    rows = [(*position(keypoint), keypoint.response) for keypoint in found]
    table = torch.tensor(rows, dtype=torch.float32).reshape(-1, 3)
    order = table[:, 2].argsort(descending=True, stable=True)[:most]
    return Features(table[order, :2], torch.from_numpy(descriptors)[order], table[order, 2], size)


def from_contrib(name: str) -> Any:
    """OpenCV's `name`, wherever this version has it: OpenCV 5 moved AKAZE from the top level to xfeatures2d.

    Raises: UserError if the installed OpenCV was built without its contrib modules.
    """
    for module in (cv2, getattr(cv2, "xfeatures2d", None)):
        if hasattr(module, name):
            return getattr(module, name)
    raise UserError(
        f"the installed OpenCV {cv2.__version__} has no {name}: run `pip uninstall opencv-python "
        "opencv-python-headless opencv-contrib-python`, then `pip install --force-reinstall "
        "opencv-contrib-python-headless`"
    )
