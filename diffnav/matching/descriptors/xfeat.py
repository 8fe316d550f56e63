"""XFeat's dense descriptors at given points, differentiable in the image."""

import kornia.feature
import torch
from torch import Tensor, nn
from torch.nn.functional import grid_sample, interpolate, normalize

from diffnav.matching.learned import freeze, open_weights
from diffnav.matching.xfeat import SOURCE

# kornia's InstanceNorm2d has this.
_NORM_EPS = 1e-5


class XFeatDescriptor(nn.Module):
    """XFeat, 64-D: image (B, 3, H, W), frames (B, K, 2, 3) -> (B, K, 64) of length 1. H and W are multiples of 32.

    kornia normalises the image without gradient, so its blocks are called one by one here. weights: file, below the
    folder of published weights or with its whole path. Source: Potje et al. 2024.
    """

    follows_turns = False

    def __init__(self, weights: str = "xfeat/xfeat_backbone_from_onnx.pt") -> None:
        super().__init__()
        found = open_weights(weights, SOURCE)
        network = kornia.feature.XFeat(1).net
        self.network = freeze(network, found.content, found.path, "cpu", may_lack=("fine_matcher.",))

    def train(self, mode: bool = True) -> "XFeatDescriptor":  # noqa: ARG002 - frozen: statistics never move
        return super().train(False)

    def forward(self, image: Tensor, frames: Tensor) -> Tensor:
        """The descriptors of the frames' positions."""
        features = self._dense(image)
        size = frames.new_tensor([image.shape[3], image.shape[2]])
        # Pixel centres: x of W lies at (2 x + 1) / W - 1, in the map of an eighth of the size as well.
        grid = ((2 * frames[..., 2] + 1) / size - 1)[:, :, None]
        sampled = grid_sample(features, grid.to(features), mode="bicubic", align_corners=False)
        return normalize(sampled[..., 0].mT, dim=2)

    def _dense(self, image: Tensor) -> Tensor:
        net = self.network
        grey = image.mean(1, keepdim=True)
        centred = grey - grey.mean((2, 3), keepdim=True)
        x = centred / (centred.square().mean((2, 3), keepdim=True) + _NORM_EPS).sqrt()
        x3 = net.block3(net.block2(net.block1(x) + net.skip1(x)))
        x4 = net.block4(x3)
        x5 = net.block5(x4)
        size = (x3.shape[2], x3.shape[3])
        coarse = [interpolate(x, size, mode="bilinear", align_corners=False) for x in (x4, x5)]
        return net.block_fusion(x3 + torch.stack(coarse).sum(0))
