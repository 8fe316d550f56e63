"""XFeat: a small network's keypoints and 64-D descriptors, mutual nearest neighbours."""

from typing import Any

import kornia.feature
import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.matching.cosine import match_by_cosine, require_cosine
from diffnav.matching.learned import device_of, freeze, no_features, open_weights, strongest
from diffnav.matching.matches import Features, Matches
from diffnav.matching.nearest import require_count

SOURCE = (
    "an ONNX export in github.com/meyiao/xfeatc, converted; the original, weights/xfeat.pt of "
    "github.com/verlab/accelerated_features or of kornia's XFeat.from_pretrained(), serves as well"
)
_WIDTH = 64
# The network sees multiples of this size; a smaller picture would be enlarged to it, and keypoints put outside of it.
_BLOCK = 32


class XFeat:
    """Keypoints and descriptors of XFeat, matched to each other's nearest by the cosine of their descriptors.

    features: how many at most, the strongest first. detection_threshold: the keypoint probability a keypoint must
    exceed. min_cosine: bound on the cosine of matched descriptors, -1 for none. weights: file, below the folder of
    published weights or with its whole path; the semi-dense refinement's part (fine_matcher) is not needed.
    device: where the network runs; features come back on the CPU.

    Its detector sees one cell of 8 x 8 pixels at a time: moving a picture by half a cell leaves a quarter of the
    correct matches of 500 keypoints, four tenths of those of 2,000.
    Source: Potje et al. 2024.
    """

    name = "xfeat"

    def __init__(
        self,
        features: int = 500,
        detection_threshold: float = 0.05,
        min_cosine: float = 0.82,
        weights: str = "xfeat/xfeat_backbone_from_onnx.pt",
        device: str = "cpu",
    ) -> None:
        require_count(features)
        require_cosine(min_cosine)
        if not 0 <= detection_threshold < 1:
            raise UserError(f"matcher.detection_threshold must be in [0, 1), got {detection_threshold}")
        found = open_weights(weights, SOURCE)
        self.network = kornia.feature.XFeat(features, detection_threshold)
        freeze(self.network.net, found.content, found.path, device, may_lack=("fine_matcher.",))
        self.settings: dict[str, Any] = {
            "features": features, "detection_threshold": detection_threshold, "min_cosine": min_cosine,
            **found.settings,
        }  # fmt: skip

    @torch.no_grad()
    def features(self, image: Tensor) -> Features:
        """Keypoints and descriptors (N, 64) of length 1 of an image (3, H, W) in [0, 1]; none below 32 pixels."""
        size = (image.shape[1], image.shape[2])
        if min(size) < _BLOCK:
            return no_features(_WIDTH, size)
        found = self.network.detectAndCompute(image[None].to(device_of(self.network)))[0]
        keypoints = to_pixel_centres(found["keypoints"], size)
        return strongest(keypoints, found["descriptors"], found["scores"], self.settings["features"], size)

    def match(self, a: Features, b: Features) -> Matches:
        """Matches that are mutual and similar enough, each position counted once."""
        return match_by_cosine(a, b, self.settings["min_cosine"], self.name, self.settings)


def to_pixel_centres(keypoints: Tensor, size: tuple[int, int]) -> Tensor:
    """kornia's XFeat keypoints (N, 2) in an image of `size` (h, w), both 32 or more, in our convention.

    kornia shrinks the image to multiples of 32 and reports pixel i of that as i * s, s = W / W'; the centre of this
    pixel is at (i + .5) s - .5 in the image.
    """
    scale = keypoints.new_tensor([side / (side // _BLOCK * _BLOCK) for side in (size[1], size[0])])
    return keypoints + (scale - 1) / 2
