"""Nearest neighbours among binary descriptors, by the number of bits that differ."""

import cv2
import torch
from torch import Tensor


def two_nearest_hamming(descriptors_a: Tensor, descriptors_b: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """(index of the nearest b, its distance in bits, the second nearest's), each (N,); infinite without a second.

    Of equally near ones the first counts as the nearest, the next as the second: with features sorted by strength, the
    stronger.

    Args: descriptors (N, D), (K, D) uint8, 8 bits each, K >= 1.
    """
    a, b = (descriptors.cpu().contiguous().numpy() for descriptors in (descriptors_a, descriptors_b))
    count = min(2, len(b))
    distances, indices = (
        torch.from_numpy(array).to(descriptors_a.device)
        for array in cv2.batchDistance(a, b, cv2.CV_32S, normType=cv2.NORM_HAMMING, K=count)
    )
    first = distances[:, 0].float()
    second = distances[:, 1].float() if count > 1 else torch.full_like(first, torch.inf)
    return indices[:, 0].long(), first, second
