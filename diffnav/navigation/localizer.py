"""From a query to a `Fix` by keypoints: shortlist, match, homography, a closer look, plausibility."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from diffnav.data.queries.query import Query
from diffnav.errors import UserError
from diffnav.matching.matches import Matcher
from diffnav.navigation.alignment import align
from diffnav.navigation.candidates import Candidate, View, look_closely, try_tile
from diffnav.navigation.fix import Fix
from diffnav.navigation.plausibility import Plausibility
from diffnav.navigation.preparation import Preparation, Prepared
from diffnav.navigation.prior import NOTHING, Prior
from diffnav.navigation.reference import Reference
from diffnav.navigation.shortlist import Shortlist
from diffnav.navigation.verdict import judge


@dataclass(frozen=True)
class Search:
    """How tiles are searched.

    tiles: how many of the shortlist are matched. winner: the tile with the most `inliers`, or the most `matches` as in
    the paper (D24). headings_deg: the query is turned by each and matched again, for matchers that bear no rotation.
    longest_side: larger queries are shrunk to it, pixels. threshold_px: error at which a match stops being an inlier,
    map pixels. refined: how many of the best tiles are looked at closely.
    Raises: UserError for a setting out of range.
    """

    tiles: int = 10
    winner: str = "inliers"
    headings_deg: Sequence[float] = (0.0,)
    longest_side: int = 1200
    threshold_px: float = 3.0
    refined: int = 2

    def __post_init__(self) -> None:
        if self.winner not in ("inliers", "matches"):
            raise UserError(f"search.winner must be inliers or matches, got {self.winner!r}")
        for name in ("tiles", "longest_side", "refined"):
            if getattr(self, name) < 1:
                raise UserError(f"search.{name} must be 1 or more, got {getattr(self, name)}")
        if not self.headings_deg:
            raise UserError("search.headings_deg is empty; write [0] for no turn")


@dataclass(frozen=True)
class Localizer:
    """Finds where a picture was taken.

    matcher: of queries with tiles, and of the queries' features. shortlist: None tries every tile in turn, as the paper
    does.
    """

    reference: Reference
    matcher: Matcher
    preparation: Preparation
    shortlist: Shortlist | None = None
    plausibility: Plausibility = field(default_factory=Plausibility)
    search: Search = field(default_factory=Search)

    def locate(self, query: Query, prior: Prior = NOTHING) -> Fix:
        """The answer to a query; a picture that cannot be read or used is an answer without a fix, not an error."""
        return self.locate_prepared(self.preparation(query), prior)

    def locate_prepared(self, prepared: Prepared, prior: Prior = NOTHING) -> Fix:
        """The answer to a query that was made ready before."""
        if prepared.image is None:
            return prepared.no_fix()
        candidates = self._candidates(prepared, prior)
        if not candidates:
            return prepared.no_fix("no map shows the expected place")
        best = candidates[0]
        facts = {"matches": best.matches, "inliers": best.inliers, "tile": self.reference.name(best.tile)}
        with prepared.watch.stage("refine"):
            views = self._views(candidates[: self.search.refined])
        if not views:
            return prepared.no_fix("no tile's matches agree on a homography", **facts)
        view = max(views, key=lambda one: len(one.points_query))
        with prepared.watch.stage("refine"):
            rival = self._rival(view, candidates)
        tile = view.candidate.tile
        facts = {"matches": view.matches, "inliers": len(view.points_query), "tile": self.reference.name(tile)}
        geo_map = self.reference.maps[self.reference.tiles[tile][0]].map
        return judge(view, rival, prior, self.plausibility, geo_map, prepared, facts)

    def _views(self, candidates: Sequence[Candidate]) -> list[View]:
        looks = [look_closely(one, self.reference, self.matcher, self.search.threshold_px) for one in candidates]
        return [view for view in looks if view is not None]

    def _rival(self, view: View, candidates: Sequence[Candidate]) -> int:
        """Inliers of the best candidate elsewhere, looked at as closely: its tile may show but a part of the place."""
        others = [one for one in candidates if view.is_elsewhere(one.place)]
        if not others:
            return 0
        best = max(others, key=lambda one: one.inliers)
        # A closer look may lead home.
        looks = [len(look.points_query) for look in self._views([best]) if view.is_elsewhere(look.place)]
        return max([best.inliers, *looks])

    def _candidates(self, prepared: Prepared, prior: Prior) -> list[Candidate]:
        """Every tile tried, the best first."""
        assert prepared.image is not None
        watch = prepared.watch
        allowed = np.arange(len(self.reference))
        if prior.place is not None and prior.radius_m is not None:
            allowed = self.reference.near(prior.place, prior.radius_m)
        if len(allowed) == 0:
            return []
        scale = self._scale(max(prepared.image.shape[1:]), prior, allowed)
        found = []
        for heading_deg in self.search.headings_deg if prior.heading_deg is None else [prior.heading_deg]:
            with watch.stage("features"):
                aligned = align(prepared.image, scale, heading_deg)
                features = aligned.features(self.matcher)
            tiles = allowed
            if self.shortlist is not None and len(allowed) > self.search.tiles:
                with watch.stage("shortlist"):
                    tiles = self.shortlist.best(features, self.search.tiles, allowed)
            with watch.stage("match"):
                found += [
                    try_tile(aligned, features, int(tile), self.reference, self.matcher, self.search.threshold_px)
                    for tile in tiles
                ]
        return sorted(found, key=lambda one: -getattr(one, self.search.winner))

    def _scale(self, side: int, prior: Prior, allowed: np.ndarray) -> float:
        """Pixels matched per pixel of the query: as many as the map has there, where that is known."""
        most = self.search.longest_side / side
        if prior.ground_sample_distance_m is None:
            return min(1.0, most)
        return min(prior.ground_sample_distance_m / float(np.median(self.reference.pixel_m[allowed])), most)
