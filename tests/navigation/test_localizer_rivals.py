"""Places that look alike: which tile wins, and when another place forbids an answer."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from localizing import PLAIN, SIFT, shown
from made_maps import DEGREE_M, ORIGIN, picture_map, placed_features
from made_noise import noise
from torch import Tensor

from diffnav.matching.matches import Features, Matches
from diffnav.navigation.feature_store import stored_features
from diffnav.navigation.localizer import Localizer, Search
from diffnav.navigation.prior import NOTHING, Prior
from diffnav.navigation.reference import Reference
from diffnav.navigation.tiles import tile_windows


def test_a_place_that_is_there_twice_is_no_fix(store: Callable) -> None:
    """Two maps show the same: whichever is taken, the other has as many inliers."""
    picture = noise((200, 300), 3)
    twins = [picture_map(picture, "one"), picture_map(picture, "other", (9000.0, 0.0))]
    localizer = Localizer(store(twins, SIFT), SIFT, PLAIN)
    query = shown(picture[:, 40:180, 50:250])
    fix = localizer.locate(query)
    assert fix.status == "no_fix"
    (reason,) = fix.reasons
    assert reason.startswith("another place has ")
    # Unless it is known to be near one of them.
    told = localizer.locate(query, Prior(ORIGIN, 500.0))
    assert (told.status, told.map) == ("fix", "one")


def test_a_place_that_is_there_twice_is_no_fix_even_where_tiles_cut_it(drawn: Path) -> None:
    """The other map's tiles each show half of the place: together they have as many inliers as the whole."""
    picture = noise((200, 300), 3)
    cut, whole = picture_map(picture, "cut", (9000.0, 0.0)), picture_map(picture, "whole")
    halves = stored_features(cut, tile_windows((200, 300), (200, 150)), SIFT, drawn / "f")
    localizer = Localizer(
        Reference([halves, stored_features(whole, [(0, 0, 200, 300)], SIFT, drawn / "f")]), SIFT, PLAIN
    )
    query = shown(picture[:, 40:180, 50:250])
    for search in (Search(refined=1), Search(refined=2)):
        fix = replace(localizer, search=search).locate(query)
        assert fix.status == "no_fix"
        assert fix.tile in ("whole/0,0", "cut/0,0", "cut/0,150")
        assert fix.reasons[0].startswith("another place has ")


class Scripted:
    """Features numbered by their descriptors; matches are pairs of equal numbers."""

    name = "scripted"
    points = 20 + torch.rand(40, 2, generator=torch.Generator().manual_seed(3)) * 60

    def __init__(self) -> None:
        self.settings: Mapping[str, Any] = {}

    def features(self, image: Tensor) -> Features:
        size = (image.shape[1], image.shape[2])
        return Features(self.points, torch.arange(40.0)[:, None], torch.ones(40), size)

    def match(self, a: Features, b: Features) -> Matches:
        numbers = b.descriptors[:, 0].long()
        return Matches(a.keypoints[numbers], b.keypoints, torch.ones(len(numbers)), self.name, self.settings)


def test_the_winner_has_the_most_inliers_or_as_in_the_paper_the_most_matches() -> None:
    """One map has 20 matches that agree, the other 40 of which 8 agree."""
    right, wrong = Scripted.points[:20] + 10, Scripted.points + 10
    wrong = torch.cat([wrong[:8], wrong[8:].flip(0)])
    maps = [
        placed_features(points.tolist(), name, (120, 120), (east, 0.0), descriptors=np.arange(len(points))[:, None])
        for name, points, east in (("agreeing", right, 0.0), ("more", wrong, 5000.0))
    ]
    query = shown(noise((100, 100), 1))
    for winner, name, inliers in (("inliers", "agreeing", 20), ("matches", "more", 8)):
        search = Search(winner=winner, refined=1)
        fix = Localizer(Reference(maps), Scripted(), PLAIN, search=search).locate(query)
        assert fix.tile == f"{name}/0,0"
        assert fix.inliers == inliers
        assert fix.matches == (20 if winner == "inliers" else 40)
        assert fix.status == ("fix" if winner == "inliers" else "no_fix")
    # Both looked at closely, the one with more inliers counts.
    both = Localizer(Reference(maps), Scripted(), PLAIN, search=Search(winner="matches", refined=2)).locate(
        query, NOTHING
    )
    assert (both.status, both.tile) == ("fix", "agreeing/0,0")


def test_a_rival_whose_closer_look_leads_home_is_none() -> None:
    """Nine chance matches say a place 36 m to the east; around it there are more of the right place's own."""
    eastmost = Scripted.points[:, 0].argsort(descending=True).tolist()[:29]
    chance = eastmost[:18:2]
    right = [number for number in eastmost if number not in chance]
    maps = [
        placed_features(
            (Scripted.points[numbers] + torch.tensor([float(x), 10])).tolist(), name, (120, 120), (east, 0.0),
            descriptors=np.array(numbers)[:, None],
        )
        for name, numbers, x, east in (("right", right, 10, 0.0), ("chance", chance, -38, 60.0))
    ]  # fmt: skip
    reference = Reference(maps)
    place = (ORIGIN[0] - 29.75 / DEGREE_M, ORIGIN[1] + 65.75 / (DEGREE_M * math.cos(math.radians(ORIGIN[0]))))
    there = set(reference.region(place, 42.0, 1).features.descriptors[:, 0].tolist())
    assert len(there & set(right)) > 13
    fix = Localizer(reference, Scripted(), PLAIN, search=Search(refined=1)).locate(shown(noise((100, 100), 1)))
    assert (fix.status, fix.map, fix.inliers) == ("fix", "right", 20)
