"""The matcher-aware terms: what an enhanced picture must have to be matched like its daylight picture.

Pure functions of tensors; who makes descriptors, responses and points sits above. Each returns a scalar >= 0 that is
differentiable in the enhanced side, finite in value and gradient for flat and black pictures as well.
"""

from collections.abc import Sequence

import torch
from kornia.color import rgb_to_grayscale
from torch import Tensor
from torch.nn.functional import huber_loss

from diffnav.blur import blur
from diffnav.geometry.homography import apply_homography, corners_of

# Of local variances on [0, 1]: about (2.5 / 255)^2, what JPEG makes of a flat place.
_FLAT_VARIANCE = 1e-4
# Of a response's mean magnitude on [0, 1], so that flat pictures divide by something.
_FAINT_RESPONSE = 1e-4
_FAINT_DISTANCE_PX2 = 1e-12


def match_loss(log_P: Tensor, valid: Tensor) -> Tensor:
    """-mean log P_ii: each valid point of the enhanced picture should find its own daylight counterpart.

    Args: log_P (B, K, K), of `dual_softmax`; valid (B, K) bool. 0 where no point is valid.
    """
    own = log_P.diagonal(dim1=1, dim2=2)
    return -(own * valid).sum() / valid.sum().clamp(min=1)


def detector_loss(enhanced: Tensor, normal: Tensor) -> Tensor:
    """Mean absolute difference of detector responses, each scale of each picture over its own mean magnitude.

    Keypoints then appear where daylight has them, whatever the contrast. Args: (B, S, H, W), of one detector.
    """
    return (_of_mean_magnitude(enhanced) - _of_mean_magnitude(normal)).abs().mean()


def structure_loss(
    enhanced: Tensor, normal: Tensor, sigmas: Sequence[float] = (1.5, 3.0, 6.0), emphasis: float = 0.0
) -> Tensor:
    """1 - local normalised cross-correlation of grey values, mean over places and Gaussian windows of `sigmas` px.

    emphasis: places are weighted by daylight's local standard deviation to this power; 0: all alike. Keypoints, the
    strongest that a matcher keeps, lie where contrast is.

    0 where the pictures agree up to a gain and an offset in every window; flat in both counts as agreement. A dense,
    cheap stand-in for descriptors, which do not see gain and offset either. Args: (B, 3, H, W) in [0, 1].
    """
    a, b = rgb_to_grayscale(enhanced), rgb_to_grayscale(normal)
    both = torch.cat([a, b, a * a, b * b, a * b], 1)
    losses = []
    for sigma in sigmas:
        mean_a, mean_b, aa, bb, ab = blur(both, sigma).unbind(1)
        # The variance is a difference of rounded numbers: it may come out below 0.
        variance_a, variance_b = (aa - mean_a**2).clamp(min=0), (bb - mean_b**2).clamp(min=0)
        product = (variance_a + _FLAT_VARIANCE) * (variance_b + _FLAT_VARIANCE)
        correlation = (ab - mean_a * mean_b + _FLAT_VARIANCE) / product.sqrt()
        weight = (variance_b + _FLAT_VARIANCE) ** (emphasis / 2)
        losses.append(1 - (weight * correlation).sum() / weight.sum())
    return torch.stack(losses).mean()


def homography_loss(
    H_a_b: Tensor, H_a_b_true: Tensor, usable: Tensor, size: tuple[int, int], most_px: float = 30.0
) -> Tensor:
    """How far the corners of image a, of `size` (h, w), land from where they belong in b, pixels.

    Mean over corners and usable samples of Huber's loss with delta 1 px, each at most `most_px`: beyond that a fit
    says nothing and has no gradient. 0 where no sample is usable.

    Args: H_a_b, H_a_b_true (B, 3, 3); usable (B,) bool. Source: DeTone et al. 2016 (corner error).
    """
    corners = corners_of(size).to(H_a_b.device)
    moved = apply_homography(H_a_b, corners) - apply_homography(H_a_b_true, corners)
    distance = (moved.square().sum(-1) + _FAINT_DISTANCE_PX2).sqrt()
    errors = huber_loss(distance, torch.zeros_like(distance), reduction="none", delta=1.0).clamp(max=most_px).mean(1)
    return torch.where(usable, errors, 0.0).sum() / usable.sum().clamp(min=1)


def _of_mean_magnitude(responses: Tensor) -> Tensor:
    return responses / (responses.abs().mean((2, 3), keepdim=True) + _FAINT_RESPONSE)
