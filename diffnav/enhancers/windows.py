"""Sums and means over rectangular windows that end at the picture's border."""

import cv2
import numpy as np


def window_sum(values: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """The sum over the window of odd size (h, w) around each place: (H, W) or (H, W, C) float32 -> the same shape."""
    return cv2.boxFilter(values, -1, size[::-1], normalize=False, borderType=cv2.BORDER_CONSTANT)


def window_mean(values: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """The mean over the part of that window that lies in the picture: (H, W) float32 -> the same shape."""
    return window_sum(values, size) / window_sum(np.ones_like(values), size)
