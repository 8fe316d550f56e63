"""SIFT descriptors of given frames, differentiable in the image: kornia's, of patches sampled at once."""

import torch
from kornia.color import rgb_to_grayscale
from kornia.feature import SIFTDescriptor
from torch import Tensor, nn
from torch.nn.functional import affine_grid, grid_sample

from diffnav.blur import blur
from diffnav.errors import UserError


class SoftSift(nn.Module):
    """SIFT descriptors, 128-D: image (B, 3, H, W), frames (B, K, 2, 3) -> (B, K, 128) of length 1.

    patch_px: side of the patches that the frames' squares are sampled to. blur_px: sigma of the Gaussian before.
    spikes: share of the gradient's values, the largest, that are cut to the size of the next; where a patch is all but
    flat its orientation turns at a touch, and one pixel's gradient reaches thousands. 0 cuts none.

    Frames should lie inside the image; beyond its edges it is mirrored.
    """

    follows_turns = True

    def __init__(self, patch_px: int = 16, blur_px: float = 1.6, spikes: float = 0.02) -> None:
        super().__init__()
        if patch_px < 8 or blur_px <= 0:
            raise UserError(f"descriptor needs patch_px of 8 or more and blur_px above 0, got {patch_px} and {blur_px}")
        if not 0 <= spikes < 1:
            raise UserError(f"descriptor needs spikes from 0 to below 1, got {spikes}")
        self.patch_px, self.blur_px, self.spikes = patch_px, blur_px, spikes
        # Not RootSIFT: the root's gradient at an empty bin is five orders above the others.
        self.sift = SIFTDescriptor(patch_px, rootsift=False).requires_grad_(False)

    def forward(self, image: Tensor, frames: Tensor) -> Tensor:
        """The descriptors; those of a flat patch are zero."""
        patches = sample_patches(blur(rgb_to_grayscale(image), self.blur_px), frames, self.patch_px)
        if patches.requires_grad and self.spikes:
            patches.register_hook(lambda gradient: cut_spikes(gradient, self.spikes))
        return self.sift(patches.flatten(0, 1)).unflatten(0, frames.shape[:2])


def sample_patches(image: Tensor, frames: Tensor, side: int) -> Tensor:
    """The squares [-1, 1]^2 of frames (B, K, 2, 3) in an image (B, C, H, W): (B, K, C, side, side).

    Pixels of a patch are the centres of side x side cells. Differentiable in the image.
    """
    count, channels = frames.shape[1], image.shape[1]
    size = frames.new_tensor([image.shape[3] - 1, image.shape[2] - 1])
    # To grid_sample's coordinates: x' = 2 x / (W - 1) - 1.
    theta = 2 * frames / size[:, None]
    theta = torch.cat([theta[..., :2], theta[..., 2:] - 1], -1)
    grid = affine_grid(theta.flatten(0, 1), [len(image) * count, 1, side, side], align_corners=False)
    grid = grid.reshape(len(image), count * side, side, 2)
    patches = grid_sample(image, grid.to(image), padding_mode="reflection", align_corners=True)
    return patches.reshape(len(image), channels, count, side, side).transpose(1, 2)


def cut_spikes(gradient: Tensor, share: float) -> Tensor:
    """The gradient with the largest `share` of its nonzero magnitudes cut to the size of the next."""
    magnitude = gradient.abs()
    nonzero = magnitude[magnitude > 0]
    if not len(nonzero):
        return gradient
    bound = nonzero.kthvalue(max(1, int((1 - share) * len(nonzero)))).values
    return gradient.clamp(-bound, bound)
