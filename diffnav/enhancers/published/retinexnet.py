"""RetinexNet with the published weights of an unofficial training: reflectance times relit illumination."""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn.functional import interpolate, relu

from diffnav.pretrained import file_sha256, filling_from, load_weights, pretrained_path


def _conv(inputs: int, outputs: int = 64, kernel: int = 3, stride: int = 1, padding: int = 1) -> nn.Conv2d:
    return nn.Conv2d(inputs, outputs, kernel, stride, padding, padding_mode="replicate")


def _joined(x: Tensor, skip: Tensor) -> Tensor:
    return torch.cat([interpolate(x, skip.shape[2:]), skip], 1)


class PublishedRetinexNet(nn.Module):
    """R o Ih without the original's denoising: (B, 3, H, W) in [0, 1] -> the same.

    folder: of published weights, None for the usual one. Raises: UserError if one does not fit.
    Source: Wei et al. 2018; attributes are called as in the weights files.
    """

    def __init__(self, folder: str | None = None) -> None:
        super().__init__()
        self.net1_conv0 = _conv(4, kernel=9, padding=4)
        self.net1_convs = nn.Sequential(*[layer for _ in range(5) for layer in (_conv(64), nn.ReLU())])
        self.net1_recon = _conv(64, 4)
        self.net2_conv0_1 = _conv(4)
        self.net2_conv1_1, self.net2_conv1_2, self.net2_conv1_3 = (_conv(64, stride=2) for _ in range(3))
        self.net2_deconv1_1, self.net2_deconv1_2, self.net2_deconv1_3 = (_conv(128) for _ in range(3))
        # Padding stands at the 1x1, as published: the 3x3 after it eats the border again.
        self.net2_fusion = _conv(192, kernel=1)
        self.net2_output = nn.Conv2d(64, 1, 3)
        source = "github.com/aasharma90/RetinexNet_PyTorch, ckpts/{}/9200.tar"
        paths = [pretrained_path(f"retinexnet/{p}/9200.tar", source.format(p), folder) for p in ("Decom", "Relight")]
        self.sha256 = " + ".join(file_sha256(path) for path in paths)
        with filling_from(paths[0].parent.parent):
            self.load_state_dict(load_weights(paths[0]) | load_weights(paths[1]))
        self.requires_grad_(False).eval()

    def forward(self, image: Tensor, record: Sequence[Any] | None = None) -> Tensor:  # noqa: ARG002
        """The enhanced image."""
        x = self.net1_conv0(torch.cat([image.amax(1, keepdim=True), image], 1))
        R_and_I = torch.sigmoid(self.net1_recon(self.net1_convs(x)))
        full = self.net2_conv0_1(R_and_I)
        half = relu(self.net2_conv1_1(full))
        quarter = relu(self.net2_conv1_2(half))
        up4 = relu(self.net2_deconv1_1(_joined(relu(self.net2_conv1_3(quarter)), quarter)))
        up2 = relu(self.net2_deconv1_2(_joined(up4, half)))
        up1 = relu(self.net2_deconv1_3(_joined(up2, full)))
        Ih = self.net2_output(self.net2_fusion(_joined(up4, _joined(up2, up1))))
        return (R_and_I[:, :3] * Ih).clamp(0, 1)
