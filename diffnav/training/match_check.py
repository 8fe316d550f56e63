"""How well an enhanced picture matches its daylight one while training goes on: a count, and lines to look at."""

import cv2
import numpy as np
import torch
from torch import Tensor

from diffnav.geometry.homography import rotate_180, rotation_180
from diffnav.images import from_uint8, quantise, to_uint8
from diffnav.matching.ground_truth import correct_matches
from diffnav.matching.matches import Features, Matcher, Matches

_RIGHT, _WRONG = (0, 200, 0), (220, 0, 0)
_MOST_LINES = 60


class MatchCheck:
    """Correct matches of one matcher: the enhanced picture turned by 180 degrees against daylight."""

    def __init__(self, matcher: Matcher) -> None:
        self.matcher = matcher
        self.name = matcher.name
        # Daylight is the same at every validation.
        self._references: dict[int, Features] = {}

    def __call__(self, index: int, enhanced: Tensor, normal: Tensor) -> tuple[int, Tensor]:
        """(how many are right within 3 px, both pictures side by side with lines); pictures (3, H, W) in [0, 1].

        index: of the pair in its fixed set.
        """
        query, normal = rotate_180(quantise(enhanced.float().cpu())), normal.cpu()
        if index not in self._references:
            self._references[index] = self.matcher.features(normal)
        matches = self.matcher.match(self.matcher.features(query), self._references[index])
        right = correct_matches(matches, rotation_180((query.shape[1], query.shape[2])))
        return int(right.sum()), draw_matches(query, normal, matches, right)


def draw_matches(query: Tensor, reference: Tensor, matches: Matches, right: Tensor) -> Tensor:
    """Two pictures (3, H, W) side by side, some matches as lines, green where right: (3, H, 2 W)."""
    canvas = np.ascontiguousarray(to_uint8(torch.cat([query, reference], 2)))
    shown = torch.linspace(0, len(matches) - 1, min(len(matches), _MOST_LINES)).long()
    for i in shown.tolist():
        start, end = matches.points_a[i].tolist(), matches.points_b[i].tolist()
        a, b = (round(start[0]), round(start[1])), (round(end[0]) + query.shape[2], round(end[1]))
        cv2.line(canvas, a, b, _RIGHT if right[i] else _WRONG, 1, cv2.LINE_AA)
    return from_uint8(canvas)
