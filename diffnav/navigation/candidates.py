"""One tile as a candidate: its matches with a query, the homography that explains most of them, where that leads."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from diffnav.geometry.geodesy import haversine_m
from diffnav.geometry.homography import apply_homography, corners_of
from diffnav.matching.matches import Features, Matcher
from diffnav.matching.verification import verify
from diffnav.navigation.alignment import Aligned
from diffnav.navigation.ground import Ground, Place
from diffnav.navigation.reference import Reference

# A homography with fewer says nothing of where to look: any four matches have one.
_LEAST_INLIERS = 6
# Of the picture's radius on the ground: how far beyond its corners the close look reaches.
_AROUND = 0.2


@dataclass(frozen=True)
class Candidate:
    """A query matched with one tile.

    tile: its number in the reference. features: of the aligned query. matches, inliers: how many. place: latitude,
    longitude where the query's middle would lie; None without a homography that leads anywhere. radius_m: of the circle
    around it that holds the query's corners.
    """

    tile: int
    aligned: Aligned
    features: Features
    matches: int
    inliers: int
    place: Place | None = None
    radius_m: float = 0.0


@dataclass(frozen=True)
class View:
    """A query laid onto the ground around a candidate's place.

    H_query_ground: (3, 3) float64, pixels of the query, of query_size (h, w), to those of `ground`. points_query,
    points_ground: (M, 2) float64, the inliers. matches: of which they are.
    """

    candidate: Candidate
    ground: Ground
    H_query_ground: Tensor
    points_query: Tensor
    points_ground: Tensor
    matches: int

    @property
    def query_size(self) -> tuple[int, int]:
        """(h, w) of the query."""
        return self.candidate.aligned.query_size

    @property
    def place(self) -> Place:
        """Latitude, longitude where the query's middle lies."""
        middle = apply_homography(self.H_query_ground, _middle_and_corners(self.query_size)[:1])
        latitude, longitude = self.ground.latlon(middle.numpy())[0]
        return float(latitude), float(longitude)

    def is_elsewhere(self, place: Place | None) -> bool:
        """Whether a place lies outside of the circle that holds the query."""
        if place is None:
            return False
        return float(haversine_m(np.array(self.place), np.array(place))) > self.candidate.radius_m


def try_tile(
    aligned: Aligned, features: Features, tile: int, reference: Reference, matcher: Matcher, threshold_px: float
) -> Candidate:
    """The candidate that a tile is for a query, given as its aligned picture and that one's features."""
    matches = matcher.match(features, reference.tile(tile))
    found = verify(matches, threshold_px=threshold_px)
    inliers = int(found.inliers.sum())
    candidate = Candidate(tile, aligned, features, len(matches), inliers)
    if found.model is None or inliers < _LEAST_INLIERS:
        return candidate
    m, k = reference.tiles[tile]
    top, left, height, width = reference.maps[m].windows[k]
    points = apply_homography(found.model @ aligned.H_query_aligned, _middle_and_corners(aligned.query_size))
    # Far outside of the tile nothing supports it, and a georeference need not be defined there.
    reach = 2 * max(height, width)
    if not bool(((points > -reach) & (points < reach + points.new_tensor([width, height]))).all()):
        return candidate
    places = reference.maps[m].map.georeference.latlon(points.numpy() + np.array([left, top]))
    radius_m = float(haversine_m(places[0], places[1:]).max())
    return Candidate(
        tile, aligned, features, len(matches), inliers, (float(places[0, 0]), float(places[0, 1])), radius_m
    )


def look_closely(candidate: Candidate, reference: Reference, matcher: Matcher, threshold_px: float) -> View | None:
    """The candidate's query matched anew with all that any map shows around its place; None without a homography."""
    if candidate.place is None:
        return None
    region = reference.region(candidate.place, candidate.radius_m * (1 + _AROUND), candidate.tile)
    matches = matcher.match(candidate.features, region.features)
    found = verify(matches, threshold_px=threshold_px)
    if found.model is None:
        return None
    H_query_aligned = candidate.aligned.H_query_aligned
    points_query = apply_homography(torch.linalg.inv(H_query_aligned), matches.points_a[found.inliers])
    return View(
        candidate,
        region.ground,
        found.model @ H_query_aligned,
        points_query,
        matches.points_b[found.inliers].double(),
        len(matches),
    )


def _middle_and_corners(size: tuple[int, int]) -> Tensor:
    height, width = size
    middle = torch.tensor([[(width - 1) / 2, (height - 1) / 2]], dtype=torch.float64)
    return torch.cat([middle, corners_of(size)])
