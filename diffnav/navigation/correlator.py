"""A localizer for queries of known place, heading and scale: dense correlation in place of keypoints."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import max_pool2d

from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.queries.query import Query
from diffnav.errors import UserError
from diffnav.navigation.alignment import Aligned, align
from diffnav.navigation.correlation import Peak, Searched, direction_field, highest_peak
from diffnav.navigation.fix import Fix
from diffnav.navigation.ground import Ground, Pose, pose_of
from diffnav.navigation.mosaic import ground_picture
from diffnav.navigation.preparation import Preparation, Prepared
from diffnav.navigation.prior import NOTHING, Prior
from diffnav.navigation.verdict import fix_at

# How far the blur carries what lies beyond an edge.
_EDGE_PX = 4
# How far around the circle rivals are looked for, in units of their least distance.
_RIVALS = 2
# A side of ground beyond this would fill the memory, pixels.
_LARGEST_PX = 4000


@dataclass(frozen=True)
class CorrelationSearch:
    """What is tried and what counts.

    longest_side: of the query as correlated, pixels. headings_deg, scales: tried around the expected ones. min_lead: of
    the best place's score over its best rival's; min_score: least score. apart_px: of a rival, pixels.
    """

    longest_side: int = 256
    headings_deg: Sequence[float] = (-6.0, -3.0, 0.0, 3.0, 6.0)
    scales: Sequence[float] = (0.94, 1.0, 1.06)
    min_lead: float = 1.2
    min_score: float = 0.1
    apart_px: int = 12

    def __post_init__(self) -> None:
        if self.longest_side < 32:
            raise UserError(f"correlation.longest_side must be 32 or more, got {self.longest_side}")
        if not self.headings_deg:
            raise UserError("correlation.headings_deg is empty; write [0] for the expected heading alone")
        if not self.scales or not min(self.scales) > 0:
            raise UserError(f"correlation.scales must be some factors above 0, got {list(self.scales)}")


@dataclass(frozen=True)
class _Expected:
    """A prior of which everything is known; pixel_m: metres a pixel of the query."""

    place: tuple[float, float]
    radius_m: float
    heading_deg: float
    pixel_m: float


@dataclass(frozen=True)
class _Best:
    aligned: Aligned
    peak: Peak
    sigma_px: float


@dataclass(frozen=True)
class Correlator:
    """Finds where a picture was taken, within the circle and at about the heading and scale of its prior."""

    maps: Sequence[GeoMap]
    preparation: Preparation
    search: CorrelationSearch = field(default_factory=CorrelationSearch)

    def locate(self, query: Query, prior: Prior = NOTHING) -> Fix:
        """The answer to a query; without place, radius, heading and scale it is no fix."""
        return self.locate_prepared(self.preparation(query), prior)

    def locate_prepared(self, prepared: Prepared, prior: Prior = NOTHING) -> Fix:
        """The answer to a query that was made ready before. Raises: ImageError for an unreadable map."""
        if prepared.image is None:
            return prepared.no_fix()
        expected = _expected(prior)
        if expected is None:
            return prepared.no_fix("correlation needs an expected place, heading and scale")
        with prepared.watch.stage("match"):
            return self._answer(prepared.image, expected, prepared)

    def _answer(self, image: Tensor, expected: _Expected, prepared: Prepared) -> Fix:
        ground, side = self._square(image, expected)
        if side > _LARGEST_PX:
            return prepared.no_fix(
                f"a circle of {expected.radius_m:.0f} m is {side} pixels wide here, too large to correlate: more than "
                f"{_LARGEST_PX}"
            )
        picture, shown = ground_picture(self.maps, ground, (side, side))
        if not shown.any():
            return prepared.no_fix("no map shows the expected place")
        searched = Searched(direction_field(picture) * _away_from_edges(shown))
        best = self._best(image, expected, ground, searched)
        lead = best.peak.score / max(best.peak.rival, 1e-6)
        reasons = []
        if best.peak.score < self.search.min_score:
            reasons.append(f"correlation {best.peak.score:.2f}, less than {self.search.min_score}")
        if lead < self.search.min_lead:
            reasons.append(f"another place fits {1 / lead:.0%} as well")
        if reasons:
            return prepared.no_fix(*reasons)
        return self._fix(best, image, ground, prepared)

    def _square(self, image: Tensor, expected: _Expected) -> tuple[Ground, int]:
        """The ground that the picture may show, wherever in the circle its middle lies, and its side in pixels.

        The expected place is the middle of the square, which is wide enough for rivals beside a small circle.
        """
        pixel_m = max(image.shape[1:]) * expected.pixel_m / self.search.longest_side
        footprint_m = math.hypot(*image.shape[1:]) * expected.pixel_m * max(self.search.scales)
        # An aligned picture is up to two pixels larger than its corners' box.
        side = math.ceil((2 * expected.radius_m + footprint_m) / pixel_m) + 2 * _RIVALS * self.search.apart_px + 2
        half_m = (side - 1) / 2 * pixel_m
        corner = Ground(expected.place, 1.0).latlon(np.array([[-half_m, -half_m]]))[0]
        return Ground((float(corner[0]), float(corner[1])), pixel_m), side

    def _best(self, image: Tensor, expected: _Expected, ground: Ground, searched: Searched) -> _Best:
        """The heading and scale around the expected ones that fit best somewhere in the circle."""
        found = []
        for turn, scale in itertools.product(self.search.headings_deg, self.search.scales):
            aligned = align(image, expected.pixel_m * scale / ground.pixel_m, expected.heading_deg + turn)
            scores = searched.scores(*_template(aligned))
            circle = _circle(scores, aligned, expected.radius_m / ground.pixel_m, searched.size[0])
            peak = highest_peak(scores, self.search.apart_px, circle)
            found.append(_Best(aligned, peak, _width(scores, peak)))
        return max(found, key=lambda one: one.peak.score)

    def _fix(self, best: _Best, image: Tensor, ground: Ground, prepared: Prepared) -> Fix:
        shift = torch.tensor([[1, 0, best.peak.x], [0, 1, best.peak.y], [0, 0, 1]], dtype=torch.float64)
        H_query_ground = shift @ best.aligned.H_query_aligned
        size = (image.shape[1], image.shape[2])
        pose = pose_of(H_query_ground, size, ground)
        geo_map = next((one for one in self.maps if _shows(one, pose)), self.maps[0])
        return fix_at(pose, H_query_ground, size, ground, best.sigma_px * ground.pixel_m, geo_map, prepared.facts)


def _expected(prior: Prior) -> _Expected | None:
    place, radius_m = prior.place, prior.radius_m
    heading_deg, pixel_m = prior.heading_deg, prior.ground_sample_distance_m
    if place is None or radius_m is None or heading_deg is None or pixel_m is None:
        return None
    return _Expected(place, radius_m, heading_deg, pixel_m)


def _away_from_edges(shown: Tensor) -> Tensor:
    """The pixels (h, w) bool whose surroundings are shown too: where a map ends is no edge on the ground."""
    hidden = max_pool2d((~shown).float()[None, None], 2 * _EDGE_PX + 1, 1, _EDGE_PX)[0, 0]
    return hidden == 0


def _template(aligned: Aligned) -> tuple[Tensor, Tensor]:
    """The direction field of an aligned picture and where it describes the query (h, w)."""
    height, width = aligned.image.shape[1:]
    y, x = torch.meshgrid(torch.arange(height), torch.arange(width), indexing="ij")
    points = torch.stack([x, y], -1).reshape(-1, 2).double()
    H = torch.linalg.inv(aligned.H_query_aligned)
    back = points @ H[:2, :2].T + H[:2, 2]
    query_height, query_width = aligned.query_size
    # Beyond the turned picture's edge it is mirrored, and the blur carries that inwards.
    margin = _EDGE_PX / math.sqrt(float(torch.linalg.det(aligned.H_query_aligned[:2, :2])))
    limit = torch.tensor([query_width - 1 - margin, query_height - 1 - margin], dtype=torch.float64)
    mask = ((back >= margin) & (back <= limit)).all(1).reshape(height, width)
    return direction_field(aligned.image), mask


def _circle(scores: Tensor, aligned: Aligned, radius_px: float, side: int) -> Tensor:
    """Which of the scores (H, W) are of places within the circle around the middle of a square of `side` pixels."""
    height, width = aligned.image.shape[1:]
    y, x = torch.meshgrid(torch.arange(scores.shape[0]), torch.arange(scores.shape[1]), indexing="ij")
    off_x, off_y = x + (width - 1) / 2 - (side - 1) / 2, y + (height - 1) / 2 - (side - 1) / 2
    # A pixel more: places lie between pixels.
    return off_x.square() + off_y.square() <= (radius_px + 1) ** 2


def _width(scores: Tensor, peak: Peak) -> float:
    """Radius of the peak where it is half as high above its rival, pixels: what the place may be off."""
    level = (peak.score + max(peak.rival, 0.0)) / 2
    return math.sqrt(max(int((scores >= level).sum()), 1) / math.pi)


def _shows(geo_map: GeoMap, pose: Pose) -> bool:
    x, y = geo_map.georeference.pixels(np.array([[pose.latitude, pose.longitude]]))[0]
    return -0.5 <= x < geo_map.size[1] - 0.5 and -0.5 <= y < geo_map.size[0] - 0.5
