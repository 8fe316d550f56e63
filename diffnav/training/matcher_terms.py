"""From an enhanced batch to the raw matcher-aware terms: keypoints of daylight, descriptors on both sides, a fit."""

from collections.abc import Mapping

import torch
from torch import Tensor, nn

from diffnav.errors import UserError
from diffnav.geometry.frames import frame_reach_px, transfer_frames
from diffnav.geometry.homography import fit_homography
from diffnav.geometry.views import draw_views, inside
from diffnav.losses.hybrid import HybridLoss
from diffnav.losses.matching import detector_loss, homography_loss, match_loss, structure_loss
from diffnav.matching.blobs import Blobs, dog_responses, strongest_blobs
from diffnav.matching.descriptors.descriptor import Descriptor
from diffnav.matching.soft import dual_softmax, not_alternatives, soft_correspondences

# The fewest confident points that a homography is fitted to.
_FEWEST = 8
# The faintest response that counts as a keypoint, on [0, 1].
_FAINTEST = 1e-3


class MatcherTerms(nn.Module):
    """(enhanced, normal, view) -> raw terms and figures to watch.

    loss: which terms, and from which keypoints. descriptors: name -> how points are described, e.g. soft_sift, xfeat;
    each has a match term of its own, and the first that follows turns the homography term.

    Raises: UserError if points are needed and none of the descriptors can describe them.
    """

    def __init__(self, loss: HybridLoss, descriptors: Mapping[str, Descriptor]) -> None:
        super().__init__()
        if loss.needs_points and not descriptors:
            raise UserError("loss.w_m and loss.w_h need descriptors: name at least one, e.g. descriptors=[soft_sift]")
        if loss.w_h and not any(descriptor.follows_turns for descriptor in descriptors.values()):
            raise UserError(f"loss.w_h needs a descriptor that follows turns, beside {', '.join(descriptors)}")
        self.loss = loss
        self.descriptors = nn.ModuleDict(descriptors if loss.needs_points else {})  # type: ignore[arg-type]

    def forward(
        self, enhanced: Tensor, normal: Tensor, H_view_normal: Tensor, exposure: Tensor
    ) -> tuple[dict[str, Tensor], dict[str, Tensor]]:
        """Terms by name, not yet weighted; `match` once per descriptor. All in float32.

        Args: enhanced, normal (B, 3, H, W), the same view; H_view_normal (B, 3, 3), exposure (B,): see `ViewedPair`.
        """
        terms: dict[str, Tensor] = {}
        figures: dict[str, Tensor] = {}
        if self.loss.w_s:
            terms["structure"] = structure_loss(enhanced, normal, self.loss.windows, self.loss.emphasis)
        if self.loss.w_d or self.loss.needs_points:
            with torch.no_grad():
                daylight = dog_responses(normal, self.loss.sigmas)
        if self.loss.w_d:
            terms["detector"] = detector_loss(dog_responses(enhanced, self.loss.sigmas), daylight)
        if self.loss.needs_points:
            blobs = strongest_blobs(daylight, self.loss.sigmas, self.loss.keypoints, _FAINTEST)
            point_terms, figures = self._of_points(enhanced, normal, blobs, H_view_normal, exposure)
            terms |= point_terms
        return terms, figures

    def _of_points(
        self, enhanced: Tensor, normal: Tensor, blobs: Blobs, H_view_normal: Tensor, exposure: Tensor
    ) -> tuple[dict[str, Tensor], dict[str, Tensor]]:
        size = (normal.shape[2], normal.shape[3])
        view = draw_views(normal, H_view_normal, size) ** exposure[:, None, None, None]
        H_normal_view = torch.linalg.inv(H_view_normal)
        seen = transfer_frames(H_normal_view, blobs.frames)
        valid = blobs.valid & _whole(seen, size)
        points, excluded = blobs.frames[..., 2], not_alternatives(blobs.frames[..., 2], valid)
        terms: dict[str, Tensor] = {}
        figures = {"keypoints": valid.float().sum(1).mean()}
        for name, descriptor in self.descriptors.items():
            # What does not follow turns is compared with daylight as it stands.
            other, frames = (view, seen) if descriptor.follows_turns else (normal, blobs.frames)
            with torch.no_grad():
                teacher = descriptor(other, frames)
            log_P = dual_softmax(descriptor(enhanced, blobs.frames), teacher, self.loss.temperature, excluded)
            match = match_loss(log_P, valid)
            figures[f"raw_match_{name}"] = match.detach()
            if self.loss.w_m:
                terms[f"match_{name}"] = match
            confidence = log_P.diagonal(dim1=1, dim2=2).detach().exp()
            figures[f"confidence_{name}"] = (confidence * valid).sum() / valid.sum().clamp(min=1)
            if self.loss.w_h and descriptor.follows_turns and "homography" not in terms:
                found = soft_correspondences(log_P, seen[..., 2])
                fit = fit_homography(points, found.points, found.confidence * valid)
                usable = fit.determined & (valid.sum(1) >= _FEWEST)
                terms["homography"] = homography_loss(fit.H, H_normal_view, usable, size).float()
                figures["degenerate"] = 1 - usable.float().mean()
        return terms, figures


def _whole(frames: Tensor, size: tuple[int, int]) -> Tensor:
    """Which frames (B, K, 2, 3) lie inside an image of `size` (h, w) with their whole disc: (B, K) bool."""
    centre, reach = frames[..., 2], frame_reach_px(frames)
    return inside(centre - reach, size) & inside(centre + reach, size)
