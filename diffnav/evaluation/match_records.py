"""One matcher on one query: its matches, how good they are against the truth, and the record of both."""

import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

from torch import Tensor

from diffnav.data.match_pairs.match_pair import MatchPair
from diffnav.geometry.homography import homography_corner_error_px
from diffnav.matching.ground_truth import correct_matches
from diffnav.matching.matches import Features, Matcher, Matches
from diffnav.matching.repeatability import are_visible, repeatability
from diffnav.matching.verification import Verification

# Where a match counts as correct and a keypoint as repeated.
CORRECT_PX = 3.0
Verify = Callable[[Matches], Verification]


@dataclass(frozen=True)
class MatchRecord:
    """What one matcher found between one method's picture and the reference.

    key: of all that it follows from. pairs: their kind. height, width: of the query. keypoints: of the query.
    mp: the matcher's own survivors. correct: those within 3 px of the truth. precision: correct / mp; inlier_ratio:
    inliers of the verification / mp; both 0 without a match. repeatability: see there. corner_error_px: of the
    verified homography, None (infinite) without one. seconds_*: each step alone, detection for the query alone;
    None where it did not come to it. failure: why the method or the matcher failed; without the method's picture
    the dark one is matched. device: that the enhancement's seconds were taken on.
    """

    key: str
    method: str
    matcher: str
    pairs: str
    name: str
    site: str
    gamma: float | None
    height: int
    width: int
    keypoints: int = 0
    mp: int = 0
    correct: int = 0
    precision: float = 0.0
    inliers: int = 0
    inlier_ratio: float = 0.0
    repeatability: float | None = None
    corner_error_px: float | None = None
    seconds_enhance: float | None = None
    seconds_detect: float | None = None
    seconds_match: float | None = None
    seconds_verify: float | None = None
    failure: str | None = None
    device: str = ""

    def flat(self) -> dict[str, object]:
        """The fields as one row of a table."""
        return asdict(self)


@dataclass(frozen=True)
class Found:
    """The query's features, its matches with the reference, and the seconds that both took."""

    features: Features
    matches: Matches
    seconds_detect: float
    seconds_match: float


def find_matches(pair: MatchPair, query: Tensor, matcher: Matcher, reference: Features) -> Found:
    """What the matcher finds between `query` and the features of the pair's reference.

    Matches that begin where the query shows no scene are left out.
    """
    start = time.perf_counter()
    features = matcher.features(query)
    detected = time.perf_counter()
    matches = matcher.match(features, reference)
    matched = time.perf_counter()
    shown = are_visible(matches.points_a, pair.visible)
    parts = (matches.points_a, matches.points_b, matches.confidence)
    points_a, points_b, confidence = (part[shown] for part in parts)
    kept = replace(matches, points_a=points_a, points_b=points_b, confidence=confidence)
    return Found(features, kept, detected - start, matched - detected)


def match_figures(pair: MatchPair, found: Found, reference: Features, verify: Verify) -> dict[str, Any]:
    """The figures of a `MatchRecord`, by name, from keypoints to seconds_verify, seconds_enhance left out."""
    H = pair.H_query_reference
    correct = int(correct_matches(found.matches, H, CORRECT_PX).sum())
    start = time.perf_counter()
    verified = verify(found.matches)
    seconds_verify = time.perf_counter() - start
    mp, inliers = len(found.matches), int(verified.inliers.sum())
    error_px = homography_corner_error_px(verified.model, H, found.features.size)
    return {
        "keypoints": len(found.features),
        "mp": mp,
        "correct": correct,
        "precision": correct / max(mp, 1),
        "inliers": inliers,
        "inlier_ratio": inliers / max(mp, 1),
        "repeatability": repeatability(found.features, reference, H, pair.visible, CORRECT_PX),
        "corner_error_px": error_px if math.isfinite(error_px) else None,
        "seconds_detect": found.seconds_detect,
        "seconds_match": found.seconds_match,
        "seconds_verify": seconds_verify,
    }
