"""Why a homography from a picture to the ground cannot be a camera's view of the matched place."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.geometry.geodesy import haversine_m
from diffnav.geometry.homography import apply_homography, corners_of
from diffnav.navigation.ground import Pose
from diffnav.navigation.prior import Prior


@dataclass(frozen=True)
class Plausibility:
    """What a fix must satisfy (D23 and beyond).

    min_inliers: matches that the homography explains. scale: least and greatest ground pixels per query pixel.
    max_stretch: of a small circle, its longest over its shortest axis, in the picture's middle and corners: how much a
    tilted camera may distort. min_spread: share of the picture's area that the inliers' ellipse of two standard
    deviations covers. heading_deg, scale_share: how far heading and scale may be off what a prior says.
    max_sigma_m: standard deviation of the place. min_lead: inliers over those of the best rival place.
    """

    min_inliers: int = 15
    scale: tuple[float, float] = (0.1, 10.0)
    max_stretch: float = 2.0
    min_spread: float = 0.02
    heading_deg: float = 30.0
    scale_share: float = 0.5
    max_sigma_m: float = 15.0
    min_lead: float = 1.5

    def __post_init__(self) -> None:
        if self.min_inliers < 5:
            raise UserError(f"plausibility.min_inliers must be 5 or more, got {self.min_inliers}: four fit anything")
        if not 0 < self.scale[0] < self.scale[1]:
            raise UserError(f"plausibility.scale must be [least, greatest], above 0, got {list(self.scale)}")

    def objections(self, H_query_ground: Tensor, size: tuple[int, int], inliers: Tensor) -> list[str]:
        """One sentence for each thing that is wrong with a view; none for a plausible one.

        Args:
            H_query_ground: (3, 3), pixels of a picture of `size` (h, w) to those of the ground.
            inliers: (M, 2) the matched pixels of the picture that it explains.
        """
        if len(inliers) < self.min_inliers:
            return [f"{len(inliers)} inliers, fewer than {self.min_inliers}"]
        jacobians = _jacobians(H_query_ground, size)
        determinants = np.linalg.det(jacobians)
        # Beyond the horizon too: it is the determinant of H over the cube of the divisor, which changes its sign there.
        if (determinants <= 0).any():
            return ["the picture would be mirrored or folded"]
        found = []
        stretch = max(float(s[0] / s[1]) for s in np.linalg.svd(jacobians, compute_uv=False))
        if stretch > self.max_stretch:
            found.append(f"stretched {stretch:.1f} times, more than {self.max_stretch}")
        scale = float(np.sqrt(determinants[0]))
        if not self.scale[0] <= scale <= self.scale[1]:
            found.append(f"{scale:.3g} ground pixels per pixel, outside of {self.scale[0]} to {self.scale[1]}")
        spread = spread_of(inliers, size)
        if spread < self.min_spread:
            found.append(f"the inliers cover {spread:.1%} of the picture, less than {self.min_spread:.1%}")
        return found

    def contradictions(self, pose: Pose, sigma_m: float, prior: Prior) -> list[str]:
        """One sentence for each thing that a prior says otherwise, or that makes the place too uncertain."""
        found = []
        if sigma_m > self.max_sigma_m:
            found.append(f"uncertain by {sigma_m:.1f} m, more than {self.max_sigma_m} m")
        if prior.place is not None and prior.radius_m is not None:
            off_m = float(haversine_m(np.array(prior.place), np.array([pose.latitude, pose.longitude])))
            if off_m > prior.radius_m:
                found.append(f"{off_m:.0f} m from the expected place, more than {prior.radius_m:.0f} m")
        if prior.heading_deg is not None:
            turn = abs((pose.heading_deg - prior.heading_deg + 180) % 360 - 180)
            if turn > self.heading_deg:
                found.append(f"heading {turn:.0f} degrees off the expected, more than {self.heading_deg:.0f}")
        if prior.ground_sample_distance_m is not None:
            ratio = pose.ground_sample_distance_m / prior.ground_sample_distance_m
            if max(ratio, 1 / ratio) > 1 + self.scale_share:
                found.append(f"scale {ratio:.2f} times the expected, more than {self.scale_share:.0%} off")
        return found


def spread_of(points: Tensor, size: tuple[int, int]) -> float:
    """Area of the points' (M, 2) ellipse of two standard deviations over that of a picture of `size` (h, w)."""
    centred = points.double() - points.double().mean(0)
    covariance = centred.T @ centred / max(len(points), 1)
    return float(4 * np.pi * torch.linalg.det(covariance).abs().sqrt() / (size[0] * size[1]))


def _jacobians(H: Tensor, size: tuple[int, int]) -> np.ndarray:
    """(5, 2, 2) derivatives of ground by picture coordinates in the middle and at the corners."""
    height, width = size
    middle = torch.tensor([[(width - 1) / 2, (height - 1) / 2]], dtype=torch.float64)
    points = torch.cat([middle, corners_of(size)])
    step = torch.tensor([[0.5, 0.0], [0.0, 0.5]], dtype=torch.float64)
    columns = [apply_homography(H, points + d) - apply_homography(H, points - d) for d in step]
    return torch.stack(columns, -1).numpy()
