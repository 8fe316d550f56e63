"""From a query laid onto the ground to a `Fix`, or to the objections against it."""

from typing import Any

import torch
from torch import Tensor

from diffnav.data.maps.geo_map import GeoMap
from diffnav.geometry.homography import apply_homography, corners_of, fit_homography
from diffnav.navigation.candidates import View
from diffnav.navigation.fix import Fix
from diffnav.navigation.ground import Ground, Pose, pose_of
from diffnav.navigation.plausibility import Plausibility
from diffnav.navigation.preparation import Prepared
from diffnav.navigation.prior import Prior
from diffnav.navigation.uncertainty import point_covariance

Size = tuple[int, int]


def judge(
    view: View,
    rival: int,
    prior: Prior,
    rules: Plausibility,
    geo_map: GeoMap,
    prepared: Prepared,
    facts: dict[str, Any],
) -> Fix:
    """The fix that a view is, or the reasons why it is none.

    Args:
        rival: inliers of the best other place.
        geo_map: to whose pixels the fix's homography leads.
        facts: more fields of the answer.
    """
    objections = rules.objections(view.H_query_ground, view.query_size, view.points_query)
    if objections:
        return prepared.no_fix(*objections, **facts)
    pose = pose_of(view.H_query_ground, view.query_size, view.ground)
    sigma_m = _sigma_m(view)
    reasons = rules.contradictions(pose, sigma_m, prior)
    if len(view.points_query) < rules.min_lead * rival:
        reasons.append(f"another place has {rival} inliers against {len(view.points_query)}")
    if reasons:
        return prepared.no_fix(*reasons, **facts)
    return fix_at(pose, view.H_query_ground, view.query_size, view.ground, sigma_m, geo_map, prepared.facts | facts)


def fix_at(
    pose: Pose,
    H_query_ground: Tensor,
    size: Size,
    ground: Ground,
    sigma_m: float,
    geo_map: GeoMap,
    facts: dict[str, Any],
) -> Fix:
    """The fix of a picture of `size` (h, w) that lies so on the ground."""
    corners = corners_of(size)
    places = ground.latlon(apply_homography(H_query_ground, corners).numpy())
    on_map = torch.from_numpy(geo_map.georeference.pixels(places))
    H = fit_homography(corners[None], on_map[None], torch.ones(1, 4)).H[0]
    return Fix(status="fix", **vars(pose), sigma_m=sigma_m, H_query_map=H / H[2, 2], map=geo_map.name, **facts)


def _sigma_m(view: View) -> float:
    """Standard deviation, per axis, of where the picture's middle lies."""
    height, width = view.query_size
    middle = torch.tensor([(width - 1) / 2, (height - 1) / 2], dtype=torch.float64)
    covariance = point_covariance(view.H_query_ground, view.points_query, view.points_ground, middle)
    return float((torch.trace(covariance) / 2).clamp(min=0).sqrt()) * view.ground.pixel_m
