"""Local affine frames: where a keypoint lies, how large its surroundings are, and how they are turned and sheared.

A frame is (2, 3), [A | x]: a point u of the unit disc lies at A u + x in the image, in pixels.
"""

import torch
from torch import Tensor

from diffnav.geometry.homography import apply_homography


def upright_frames(keypoints: Tensor, radius_px: Tensor) -> Tensor:
    """Frames (B, K, 2, 3) of discs around keypoints (B, K, 2) with radii (B, K) in pixels, not turned."""
    A = torch.eye(2).to(keypoints) * radius_px[..., None, None]
    return torch.cat([A, keypoints[..., None]], -1)


def transfer_frames(H_a_b: Tensor, frames: Tensor) -> Tensor:
    """The frames of image a as they appear in image b, to first order: (B, K, 2, 3).

    Args: H_a_b (B, 3, 3); frames (B, K, 2, 3).
    """
    H = H_a_b.double()
    points = frames[..., 2].double()
    mapped = apply_homography(H, points)
    scale = points @ H[:, 2:, :2].mT + H[:, None, 2:, 2]
    # d(X / w) = (dX - (X / w) dw) / w
    J = (H[:, None, :2, :2] - mapped[..., None] * H[:, None, 2:, :2]) / scale[..., None]
    return torch.cat([J @ frames[..., :2].double(), mapped[..., None]], -1).to(frames)


def frame_reach_px(frames: Tensor) -> Tensor:
    """Half of the sides of the box around each frame's disc, (B, K, 2) in x, y."""
    return frames[..., :2].norm(dim=-1)
