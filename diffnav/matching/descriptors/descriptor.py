"""What a differentiable descriptor takes and gives."""

from typing import Protocol

from torch import Tensor


class Descriptor(Protocol):
    """`descriptor(image, frames)` -> descriptors (B, K, D) of length 1, differentiable in image (B, 3, H, W).

    frames: (B, K, 2, 3), see `geometry.frames`. follows_turns: whether a frame's turn and shear are taken out, so that
    a picture seen from elsewhere has the same descriptors; where not, frames give positions only.
    """

    follows_turns: bool

    def __call__(self, image: Tensor, frames: Tensor) -> Tensor: ...
