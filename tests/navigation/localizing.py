"""Queries, a counting matcher and checks for the tests of the localizer."""

import numpy as np
import pytest
from torch import Tensor

from diffnav.data.queries.cut import CutQuery
from diffnav.data.queries.query import Query
from diffnav.geometry.geodesy import haversine_m
from diffnav.geometry.homography import homography_corner_error_px
from diffnav.matching.matches import Features, Matches
from diffnav.matching.sift import Sift
from diffnav.navigation.fix import Fix
from diffnav.navigation.gates.gate import Never
from diffnav.navigation.preparation import Preparation

PLAIN = Preparation(Never(), lambda image: image)
SIFT = Sift(800)


class Counting:
    """SIFT that counts how often it matches."""

    name, settings = "counting", SIFT.settings

    def __init__(self) -> None:
        self.matched = 0

    def features(self, image: Tensor) -> Features:
        return SIFT.features(image)

    def match(self, a: Features, b: Features) -> Matches:
        self.matched += 1
        return SIFT.match(a, b)


def shown(picture: Tensor, name: str = "photo") -> Query:
    return Query(name, lambda: picture)


def error_m(fix: Fix, query: Query) -> float:
    assert fix.place is not None
    assert query.truth is not None
    return float(haversine_m(np.array(fix.place), np.array(query.truth)))


def check_found(fix: Fix, query: CutQuery, within_m: float = 0.5) -> None:
    assert fix.status == "fix", fix.reasons
    assert error_m(fix, query) < within_m
    assert abs(((fix.heading_deg or 0) - (query.heading_deg or 0) + 180) % 360 - 180) < 0.5
    assert fix.ground_sample_distance_m == pytest.approx(query.ground_sample_distance_m, rel=0.01)
    assert fix.H_query_map is not None
    assert homography_corner_error_px(fix.H_query_map, query.H_query_map, (240, 320)) < 5 * within_m
    assert (fix.query, fix.map, fix.reasons) == (query.name, query.map, ())
    assert (fix.tile or "").startswith(f"{query.map}/")
    assert len(fix.footprint) == 4
    # No surer than it is, and not much less sure.
    assert fix.sigma_m is not None
    assert error_m(fix, query) / 5 < fix.sigma_m < 1
