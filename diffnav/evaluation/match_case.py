"""One query with its matches, to be looked at."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor, nn

from diffnav.data.match_pairs.match_pair import MatchPair
from diffnav.evaluation.match_figure import draw_matches
from diffnav.evaluation.match_records import CORRECT_PX, find_matches
from diffnav.images import resize
from diffnav.matching.ground_truth import correct_matches
from diffnav.matching.matches import Features, Matcher, Matches


@dataclass(frozen=True)
class MatchCase:
    """A query and its reference, (3, H, W) each, and the matches between them; correct: (M,) bool, within 3 px."""

    query: Tensor
    reference: Tensor
    matches: Matches
    correct: Tensor

    def draw(self, max_lines: int = 80, shrink: float = 1.0) -> np.ndarray:
        """Query and reference side by side, shrunk by a factor of at most 1, with match lines: (H, W, 3) uint8."""
        if shrink == 1:
            return draw_matches(self.query, self.reference, self.matches, self.correct, max_lines)
        # Before the lines are drawn, which would become faint.
        images, points = [], []
        for image, own in ((self.query, self.matches.points_a), (self.reference, self.matches.points_b)):
            size = round(image.shape[1] * shrink), round(image.shape[2] * shrink)
            factors = own.new_tensor([size[1] / image.shape[2], size[0] / image.shape[1]])
            images.append(resize(image, size))
            points.append((own + 0.5) * factors - 0.5)
        matches = replace(self.matches, points_a=points[0], points_b=points[1])
        return draw_matches(images[0], images[1], matches, self.correct, max_lines)


@torch.no_grad()
def match_enhanced(pair: MatchPair, enhancers: Mapping[str, nn.Module], matcher: Matcher) -> dict[str, MatchCase]:
    """Name of the enhancer -> what its picture of the pair matches in the reference."""
    reference, record = matcher.features(pair.reference), pair.pair["record"]
    low, records = pair.pair["low"][None], [record] if record else None
    return {
        name: match_case(pair, enhancer(low, records)[0], matcher, reference) for name, enhancer in enhancers.items()
    }


def match_case(pair: MatchPair, enhanced: Tensor, matcher: Matcher, reference: Features | None = None) -> MatchCase:
    """What the matcher finds between the pair's enhanced picture and its reference, whose features may be given."""
    query = pair.query(enhanced)
    features = matcher.features(pair.reference) if reference is None else reference
    matches = find_matches(pair, query, matcher, features).matches
    return MatchCase(query, pair.reference, matches, correct_matches(matches, pair.H_query_reference, CORRECT_PX))
