"""The enhancers made of the two networks: `RetinexEnhancer` (the paper's) and `DirectEnhancer` (its plain rival)."""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

from torch import Tensor
from torch.nn.functional import pad

from diffnav.errors import UserError
from diffnav.retinex.decom import DecomNet, Padding
from diffnav.retinex.enhance import EnhanceNet
from diffnav.retinex.tiles import HALO, TiledEnhancer

# The smallest side of an image that the networks take.
SMALLEST_PX = 16
# Keeps the exact reflectance finite where no light falls; a quarter of an 8-bit step.
_DARKEST = 1e-3


class Components(NamedTuple):
    """What the networks make of a dark image: R (B, 3, H, W), I and Ih (B, 1, H, W), enhanced = Ih o R (Eq. 1)."""

    R: Tensor
    I: Tensor
    Ih: Tensor
    enhanced: Tensor


class Enhancer(TiledEnhancer):
    """Decom-Net and Enhance-Net: what both enhancers share."""

    halo = HALO
    illumination_channels: int

    def __init__(
        self,
        width: int = 64,
        jump: Literal["add", "concat"] = "add",
        max_channel: bool = True,
        up_kernel: Literal[2, 4] = 4,
        activation: Literal["sigmoid", "relu", "none"] = "sigmoid",
        padding: Padding = "replicate",
        detail: bool = False,
    ) -> None:
        super().__init__()
        if width < 1:
            raise UserError(f"network.width must be 1 or more, got {width}")
        if padding not in ("replicate", "zeros"):
            raise UserError(f"network.padding must be replicate or zeros, got {padding!r}")
        self.settings = {
            "width": width,
            "jump": jump,
            "max_channel": max_channel,
            "up_kernel": up_kernel,
            "activation": activation,
            "padding": padding,
        }
        self.decom = DecomNet(width, jump, max_channel, padding)
        self.enhance = EnhanceNet(width, up_kernel, activation, self.illumination_channels, padding, detail)


class RetinexEnhancer(Enhancer):
    """The paper's: dark image -> Decom-Net -> R, I -> Enhance-Net -> Ih -> Ih o R (Eq. 1).

    Two departures, off by default. reflectance: `exact` takes R = S / I, clipped, in place of Decom-Net's R, so that
    no detail is lost before Enhance-Net. detail: Enhance-Net adds a residual, Ih o R + D.
    """

    illumination_channels = 1

    def __init__(
        self,
        width: int = 64,
        *,
        reflectance: Literal["network", "exact"] = "network",
        detail: bool = False,
        **settings: Any,
    ) -> None:
        super().__init__(width, detail=detail, **settings)
        if reflectance not in ("network", "exact"):
            raise UserError(f"reflectance must be network or exact, got {reflectance!r}")
        # Named where they depart from the paper: what others wrote before them reads as it did.
        self.settings |= {"reflectance": reflectance} if reflectance != "network" else {}
        self.settings |= {"detail": True} if detail else {}
        self.reflectance = reflectance

    def components(self, image: Tensor) -> Components:
        """R, I, Ih and the enhanced image of a whole image (B, 3, H, W) of any size from 16 x 16."""
        return Components(*on_padded(self._components, image))

    def decompose(self, image: Tensor) -> tuple[Tensor, Tensor]:
        """R and I alone, of an image (B, 3, H, W) of any size from 16 x 16."""
        R, I = on_padded(self.decom, image)
        return R, I

    def _components(self, image: Tensor) -> tuple[Tensor, ...]:
        R, I = self.decom(image)
        if self.reflectance == "exact":
            R = exact_reflectance(image, I)
        output = self.enhance(R, I)
        Ih, residual = output[:, :1], output[:, 1:]
        return R, I, Ih, Ih * R + residual if residual.shape[1] else Ih * R

    def _whole(self, image: Tensor) -> Tensor:
        return self.components(image).enhanced


class DirectEnhancer(Enhancer):
    """The same two trunks without the Retinex split: image to image, the honest rival of the same size and cost.

    Decom-Net's four outputs feed Enhance-Net, whose last layer gives the picture (3 channels), not an illumination.
    """

    illumination_channels = 3

    def _whole(self, image: Tensor) -> Tensor:
        return on_padded(lambda x: (self.enhance(*self.decom(x)),), image)[0]


def exact_reflectance(image: Tensor, I: Tensor) -> Tensor:
    """R = S / (I + .001), clipped to [0, 1]: (B, 3, H, W) of an image and its illumination (B, 1, H, W)."""
    return (image / (I + _DARKEST)).clamp(0, 1)


def on_padded(network: Callable[[Tensor], tuple[Tensor, ...]], image: Tensor) -> tuple[Tensor, ...]:
    """Run `network` on the image padded by reflection to multiples of 8, and crop its outputs back."""
    height, width = image.shape[2:]
    if min(height, width) < SMALLEST_PX:
        raise ValueError(
            f"need an image of {SMALLEST_PX} x {SMALLEST_PX} or more, got {width} x {height}; enlarge it first"
        )
    # In this form torch.export knows the padded sides as multiples of 8, and the network's skips as fitting.
    right, bottom = (width + 7) // 8 * 8 - width, (height + 7) // 8 * 8 - height
    padded = pad(image, (0, right, 0, bottom), mode="reflect") if right or bottom else image
    return tuple(out[..., :height, :width] for out in network(padded))
