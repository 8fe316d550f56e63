"""One query's matches to look at: the same as by hand, and drawn where they are when pictures are shrunk."""

import numpy as np
import torch
from matching_stubs import SIZE, KnownMatcher, picture, turned

from diffnav.enhancers.gamma_blind import GammaBlind
from diffnav.enhancers.gamma_oracle import GammaOracle
from diffnav.evaluation.match_case import MatchCase, match_case, match_enhanced
from diffnav.evaluation.match_figure import GAP_PX, GREEN
from diffnav.geometry.homography import rotate_180, rotation_180
from diffnav.matching.ground_truth import correct_matches
from diffnav.matching.matches import Matches
from diffnav.matching.sift import Sift


def test_a_case_is_what_the_matcher_finds_in_the_turned_picture():
    pairs, photo = turned(1)[0]
    pair, sift = pairs.read(photo), Sift()
    cases = match_enhanced(pair, {"a": GammaBlind(4.0), "oracle": GammaOracle()}, sift)
    query = rotate_180(pair.pair["low"] ** 0.25)
    expected = sift.match(sift.features(query), sift.features(pair.pair["normal"]))
    assert torch.equal(cases["a"].query, query)
    assert torch.equal(cases["a"].matches.points_a, expected.points_a)
    assert torch.equal(cases["a"].correct, correct_matches(expected, rotation_180(SIZE)))
    assert len(cases["oracle"].matches) > 0


def test_the_known_matcher_has_eight_right():
    pairs, photo = turned(1)[0]
    case = match_case(pairs.read(photo), picture(0), KnownMatcher())
    assert case.correct.tolist() == [True] * 8 + [False] * 2


def test_a_shrunk_drawing_has_its_lines_in_the_same_places():
    """A level line through the middles of two grey pictures, 41 pixels down, is 20.5 down in half the size."""
    grey = torch.full((3, 120, 160), 0.5)
    matches = Matches(torch.tensor([[21.0, 41.0]]), torch.tensor([[101.0, 41.0]]), torch.ones(1), "m", {})
    case = MatchCase(grey, grey, matches, torch.tensor([True]))
    whole, half = case.draw(), case.draw(shrink=0.5)
    assert whole.shape == (120, 320 + GAP_PX, 3)
    assert half.shape == (60, 160 + GAP_PX, 3)

    def green(drawing):
        return np.argwhere(np.abs(drawing.astype(int) - GREEN).max(-1) < 60)

    assert np.abs(green(whole)[:, 0] - 41).max() <= 2
    # (41 + .5) / 2 - .5 = 20.25, from x = 10.25 in the left picture to 80 + 8 + 50.25.
    assert np.abs(green(half)[:, 0] - 20.25).max() <= 2.5
    assert abs(green(half)[:, 1].min() - 10.25) <= 3
    assert abs(green(half)[:, 1].max() - (80 + GAP_PX + 50.25)) <= 3
