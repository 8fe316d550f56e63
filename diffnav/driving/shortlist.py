"""Which references look like a query as a whole: histograms of gradients of small pictures (Dalal & Triggs 2005)."""

from collections.abc import Sequence

import cv2
import numpy as np
from torch import Tensor

from diffnav.images import to_uint8

# Of the small picture, (width, height); blocks of 16 px step by 8.
_SIZE = (128, 64)
_HOG = (_SIZE, (16, 16), (8, 8), (8, 8), 9)


def picture_descriptor(image: Tensor) -> np.ndarray:
    """(D,) float32 of length 1 of an image (3, H, W) in [0, 1]: the same for any contrast; zeros for a flat picture."""
    grey = cv2.cvtColor(to_uint8(image), cv2.COLOR_RGB2GRAY)
    small = cv2.resize(grey, _SIZE, interpolation=cv2.INTER_AREA)
    descriptor: np.ndarray = np.asarray(cv2.HOGDescriptor(*_HOG).compute(small), np.float32).ravel()
    return descriptor / max(float(np.linalg.norm(descriptor)), float(np.finfo(np.float32).tiny))


def most_alike(query: np.ndarray, references: np.ndarray | Sequence[np.ndarray], count: int) -> list[int]:
    """Numbers of the `count` references (R, D) most like the query (D,), the most alike first."""
    return np.argsort(-(np.asarray(references) @ query), kind="stable")[:count].tolist()
