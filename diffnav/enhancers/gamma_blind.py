"""Eq. 9 inverted with one fixed gamma: the honest rival that knows the kind of darkness, not its strength."""

from collections.abc import Sequence

from torch import Tensor, nn

from diffnav.darkness import Darkening, invert_gamma
from diffnav.errors import UserError


class GammaBlind(nn.Module):
    """x^(1 / gamma) for every image: (B, 3, H, W) in [0, 1] -> the same. gamma: the middle of the paper's U(3, 5)."""

    def __init__(self, gamma: float = 4.0) -> None:
        super().__init__()
        if gamma <= 0:
            raise UserError(f"gamma_blind's gamma must be above 0, got {gamma}")
        self.gamma = gamma

    def forward(self, image: Tensor, record: Sequence[Darkening] | None = None) -> Tensor:  # noqa: ARG002
        return invert_gamma(image, self.gamma)
