"""From a query laid onto the ground to a fix, or to the objections against it."""

import math
from dataclasses import replace

import pytest
import torch
from made_maps import DEGREE_M, ORIGIN, metres_from, placed_features

from diffnav.geometry.homography import apply_homography
from diffnav.matching.matches import Features
from diffnav.navigation.alignment import Aligned
from diffnav.navigation.candidates import Candidate, View
from diffnav.navigation.fix import Fix
from diffnav.navigation.ground import Ground
from diffnav.navigation.plausibility import Plausibility
from diffnav.navigation.preparation import Prepared
from diffnav.navigation.prior import NOTHING, Prior
from diffnav.navigation.stopwatch import Stopwatch
from diffnav.navigation.uncertainty import point_covariance
from diffnav.navigation.verdict import judge

SIZE = (201, 301)
# A map of .25 m a pixel whose first pixel lies 40 m west and 60 m north of the origin.
MAP = placed_features([], "square", (600, 800), (-40.0, 60.0), 0.25).map
# The ground's pixels are of .5 m, from 20 m west and 30 m north of the origin on.
CORNER = (ORIGIN[0] + 30 / DEGREE_M, ORIGIN[1] - 20 / (DEGREE_M * math.cos(math.radians(ORIGIN[0] + 15 / DEGREE_M))))
GROUND = Ground(CORNER, 0.5)
# Half of a ground pixel per pixel, top to the east: x goes south, y west. The middle, (150, 100), comes to (70, 80).
H_QUERY_GROUND = torch.tensor([[0, -0.5, 120], [0.5, 0, 5], [0, 0, 1]], dtype=torch.float64)

MIRRORED = H_QUERY_GROUND * torch.tensor([-1, 1, 1])


def view_of(noise_px: float = 0.2, count: int = 40, H: torch.Tensor = H_QUERY_GROUND) -> View:
    dice = torch.Generator().manual_seed(1)
    points = torch.rand(count, 2, generator=dice, dtype=torch.float64) * torch.tensor([300.0, 200])
    there = apply_homography(H, points)
    there = there + noise_px * torch.randn(count, 2, generator=dice, dtype=torch.float64)
    nothing = Features(torch.zeros(0, 2), torch.zeros(0, 1), torch.zeros(0), SIZE)
    aligned = Aligned(torch.zeros(3, *SIZE), torch.eye(3, dtype=torch.float64), SIZE)
    candidate = Candidate(0, aligned, nothing, 55, 33, ORIGIN, 50.0)
    return View(candidate, GROUND, H, points, there, 55)


def answer(view: View, rival: int = 0, prior: Prior = NOTHING, rules: Plausibility | None = None) -> Fix:
    prepared = Prepared(None, {"query": "photo", "enhanced": True}, Stopwatch())
    facts = {"inliers": len(view.points_query), "matches": view.matches, "tile": "square/0,0"}
    return judge(view, rival, prior, rules or Plausibility(), MAP, prepared, facts)


def test_a_plausible_view_is_a_fix() -> None:
    fix = answer(view_of())
    assert (fix.status, fix.query, fix.map, fix.tile, fix.enhanced) == ("fix", "photo", "square", "square/0,0", True)
    assert (fix.inliers, fix.matches, fix.reasons) == (40, 55, ())
    assert fix.place is not None
    # 70 and 80 pixels of half a metre from the corner.
    assert metres_from(ORIGIN, fix.place) == pytest.approx((-20 + 35, 30 - 40), abs=0.01)
    assert fix.heading_deg == pytest.approx(90, abs=0.01)
    assert fix.ground_sample_distance_m == pytest.approx(0.25, rel=1e-5)
    # The picture's upper left corner shows what is farthest to the north and east: (120, 5) on the ground.
    assert metres_from(ORIGIN, fix.footprint[0]) == pytest.approx((-20 + 60, 30 - 2.5), abs=0.01)


def test_the_homography_leads_to_pixels_of_the_whole_map() -> None:
    fix = answer(view_of())
    assert fix.H_query_map is not None
    assert fix.H_query_map[2, 2] == 1
    points = torch.tensor([[0.0, 0], [300, 200], [150, 100], [30, 170]])
    ground = apply_homography(H_QUERY_GROUND, points)
    # Half a metre of ground are two pixels of the map; its first lies 20 m farther west and 30 m farther north.
    expected = 2 * ground + torch.tensor([80.0, 120.0])
    assert torch.allclose(apply_homography(fix.H_query_map, points), expected, atol=0.01)


def test_sigma_is_the_mean_over_both_axes_in_metres() -> None:
    """A ground pixel is half a metre. The mean of 40 measurements of .8 px alone would be off by .8 / sqrt(40)."""
    view = view_of(noise_px=0.8)
    fix = answer(view)
    assert fix.sigma_m is not None
    assert 1.0 < fix.sigma_m / (0.8 / math.sqrt(40) * 0.5) < 2.5
    covariance = point_covariance(
        view.H_query_ground, view.points_query, view.points_ground, torch.tensor([150.0, 100])
    )
    assert fix.sigma_m == pytest.approx(0.5 * math.sqrt((covariance[0, 0] + covariance[1, 1]) / 2), rel=1e-6)
    unsure = answer(view_of(noise_px=0.8), rules=Plausibility(max_sigma_m=fix.sigma_m * 0.99))
    assert unsure.reasons == (f"uncertain by {fix.sigma_m:.1f} m, more than {fix.sigma_m * 0.99} m",)


@pytest.mark.parametrize(
    ("view", "rival", "prior", "reasons"),
    [
        (view_of(count=14), 0, NOTHING, ("14 inliers, fewer than 15",)),
        (view_of(H=MIRRORED), 0, NOTHING, ("the picture would be mirrored or folded",)),
        (view_of(), 27, NOTHING, ("another place has 27 inliers against 40",)),
        (
            view_of(), 30, Prior(heading_deg=0.0),
            ("heading 90 degrees off the expected, more than 30", "another place has 30 inliers against 40"),
        ),
    ],
    ids=["few", "mirrored", "rival", "rival and prior"],
)  # fmt: skip
def test_objections_are_no_fix(view: View, rival: int, prior: Prior, reasons: tuple[str, ...]) -> None:
    fix = answer(view, rival, prior)
    assert fix.status == "no_fix"
    assert fix.reasons == reasons
    assert fix.place is None
    assert fix.footprint == ()
    assert fix.H_query_map is None
    assert (fix.query, fix.inliers, fix.matches) == ("photo", len(view.points_query), 55)


def test_a_weaker_rival_does_not_matter() -> None:
    assert answer(view_of(), rival=26).status == "fix"
    assert answer(view_of(), rival=39, rules=Plausibility(min_lead=1.0)).status == "fix"


def test_a_view_far_from_the_map_it_was_found_in_still_has_its_place() -> None:
    """The query's corners may lie beyond its map: the homography goes on evenly."""
    beyond = replace(view_of(H=torch.tensor([[1.0, 0, -200], [0, 1, -300], [0, 0, 1]]).double()), ground=GROUND)
    fix = answer(beyond)
    assert fix.status == "fix"
    assert fix.H_query_map is not None
    expected = 2 * torch.tensor([[-200.0, -300]]) + torch.tensor([80.0, 120])
    assert torch.allclose(apply_homography(fix.H_query_map, torch.zeros(1, 2)), expected.double(), atol=0.02)
