"""Matching against the daylight picture turned by 180 degrees, the paper's stand-in for a change of heading."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from diffnav.data.pairs import WholePair
from diffnav.evaluation.match_figure import draw_matches
from diffnav.geometry.homography import rotate_180, rotation_180
from diffnav.matching.ground_truth import correct_matches
from diffnav.matching.matches import Matcher, Matches


@dataclass(frozen=True)
class RotatedMatch:
    """One enhanced picture, turned, and its matches with the daylight picture; correct: (M,) bool, within 3 px."""

    query: Tensor
    reference: Tensor
    matches: Matches
    correct: Tensor

    def draw(self, max_lines: int = 80) -> np.ndarray:
        """Query and reference side by side with match lines: (H, W, 3) uint8."""
        return draw_matches(self.query, self.reference, self.matches, self.correct, max_lines)


@torch.no_grad()
def match_rotated(pair: WholePair, enhancers: Mapping[str, nn.Module], matcher: Matcher) -> dict[str, RotatedMatch]:
    """Name of the enhancer -> what its picture of the pair, turned by 180 degrees, matches in the daylight one."""
    reference = pair["normal"]
    H_query_reference = rotation_180((reference.shape[1], reference.shape[2]))
    features = matcher.features(reference)
    results = {}
    for name, enhancer in enhancers.items():
        query = rotate_180(enhancer(pair["low"][None], [pair["record"]])[0])
        matches = matcher.match(matcher.features(query), features)
        results[name] = RotatedMatch(query, reference, matches, correct_matches(matches, H_query_reference))
    return results
