"""The features of a map, tile after tile, and those of any window of it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch

from diffnav.data.maps.geo_map import GeoMap, Window
from diffnav.matching.matches import Features


@dataclass(frozen=True)
class MapFeatures:
    """The features of one map's tiles, perhaps still on disk.

    windows: of the tiles, all of one size. offsets: (T + 1,), features of tile k are those from offsets[k] to
    offsets[k + 1]. keypoints: (N, 2) float32 pixels of the whole map. descriptors: (N, D) uint8 or float32; scores:
    (N,) float32. numbers: whether uint8 descriptors are numbers, such as SIFT's, not bits.
    """

    map: GeoMap
    windows: tuple[Window, ...]
    offsets: np.ndarray
    keypoints: np.ndarray
    descriptors: np.ndarray
    scores: np.ndarray
    numbers: bool

    def tile(self, k: int) -> Features:
        """The features of tile k alone, keypoints from its own top left."""
        return self._features(slice(self.offsets[k], self.offsets[k + 1]), self.windows[k])

    def within(self, window: Window) -> Features:
        """The features inside a window, each place's from one tile alone, keypoints from the window's top left."""
        found = [np.zeros(0, np.int64)]
        for k in self._meeting(window):
            start, end = self.offsets[k], self.offsets[k + 1]
            points = self.keypoints[start:end]
            rows = np.flatnonzero(_inside(points, window))
            found.append(start + rows[self._home(points[rows], k) == k])
        return self._features(np.concatenate(found), window)

    @property
    def size_bytes(self) -> int:
        """What the features take on disk."""
        return sum(array.nbytes for array in (self.offsets, self.keypoints, self.descriptors, self.scores))

    def _features(self, rows: np.ndarray | slice, window: Window) -> Features:
        # Copied: a memory map must not be handed on.
        descriptors = torch.from_numpy(np.array(self.descriptors[rows]))
        keypoints = torch.from_numpy(self.keypoints[rows] - np.array([window[1], window[0]], np.float32))
        return Features(
            keypoints,
            descriptors.float() if self.numbers else descriptors,
            torch.from_numpy(np.array(self.scores[rows])),
            (window[2], window[3]),
        )

    def _home(self, points: np.ndarray, tile: int) -> np.ndarray:
        """The tile whose middle is nearest to each point (N, 2) of a tile: where tiles overlap, a place has one home.

        Nearest in shares of a tile, so that the borders between homes lie within both tiles, whatever their shape.
        """
        near = self._meeting(self.windows[tile])
        top, left, height, width = self._boxes[near].T
        middles = np.stack([left + (width - 1) / 2, top + (height - 1) / 2], 1)
        return near[np.abs((points[:, None] - middles) / [width[0], height[0]]).max(-1).argmin(1)]

    def _meeting(self, window: Window) -> np.ndarray:
        """The numbers of the tiles that share a pixel with a window."""
        top, left, height, width = self._boxes.T
        below, right = window[0] + window[2], window[1] + window[3]
        return np.flatnonzero((top < below) & (window[0] < top + height) & (left < right) & (window[1] < left + width))

    @cached_property
    def _boxes(self) -> np.ndarray:
        return np.array(self.windows)


def _inside(points: np.ndarray, window: Window) -> np.ndarray:
    top, left, height, width = window
    low, high = np.array([left, top]) - 0.5, np.array([left + width, top + height]) - 0.5
    return np.all((points >= low) & (points < high), axis=1)
