"""Blobs of a batch of images: difference-of-Gaussian responses, and the strongest of them as frames."""

from collections.abc import Sequence
from typing import NamedTuple

import torch
from kornia.color import rgb_to_grayscale
from torch import Tensor
from torch.nn.functional import max_pool2d

from diffnav.blur import blur
from diffnav.geometry.frames import upright_frames

# Ratio of the two Gaussians of a difference: three levels to the octave, as SIFT has.
_STEP = 2 ** (1 / 3)
# Of SIFT's descriptor: four cells of three sigma each, half of them on each side.
_RADIUS_SIGMAS = 6.0


class Blobs(NamedTuple):
    """frames (B, K, 2, 3), discs of six sigma, not turned; valid (B, K) bool, where there were so many."""

    frames: Tensor
    valid: Tensor


def dog_responses(image: Tensor, sigmas: Sequence[float]) -> Tensor:
    """Differences of Gaussians of the grey image, G(1.26 sigma) - G(sigma): (B, S, H, W), differentiable.

    Args: image (B, 3, H, W) in [0, 1]; sigmas in pixels, S of them. Source: Lowe 2004, section 3.
    """
    grey = rgb_to_grayscale(image)
    return torch.cat([blur(grey, _STEP * sigma) - blur(grey, sigma) for sigma in sigmas], 1)


@torch.no_grad()
def strongest_blobs(responses: Tensor, sigmas: Sequence[float], count: int, least: float = 0.0) -> Blobs:
    """The `count` extrema of strongest response whose whole disc lies inside the image, the strongest first.

    An extremum is the largest magnitude of its 3 x 3 neighbourhood at its own scale and the scales next to it.

    Args: responses (B, S, H, W), of `dog_responses` at `sigmas`; least: bound on the magnitude.
    """
    magnitude = responses.abs()
    nearby = max_pool2d(magnitude, 3, stride=1, padding=1)
    highest = torch.stack([nearby[:, max(s - 1, 0) : s + 2].amax(1) for s in range(len(sigmas))], 1)
    height, width = responses.shape[2:]
    y, x = (torch.arange(side, device=responses.device) for side in (height, width))
    to_edge = torch.minimum(torch.minimum(y, height - 1 - y)[:, None], torch.minimum(x, width - 1 - x)[None])
    radii = _RADIUS_SIGMAS * responses.new_tensor(list(sigmas))
    extremum = (magnitude == highest) & (magnitude > least) & (to_edge >= radii[:, None, None])
    strength, places = torch.where(extremum, magnitude, -1.0).flatten(1).topk(count)
    scale, pixel = places // (height * width), places % (height * width)
    keypoints = torch.stack([pixel % width, pixel // width], -1).to(responses)
    return Blobs(upright_frames(keypoints, radii[scale]), strength > 0)
