"""LIME (Guo, Li and Ling 2017): the brightest channel, smoothed along structure, is the illumination divided out."""

from collections.abc import Sequence

import cv2
import numpy as np
import torch
from torch import Tensor, nn

from diffnav.darkness import Darkening
from diffnav.enhancers.weighted_least_squares import GridSystem, gradient, solve
from diffnav.errors import UserError

# Steps of the solver; photos at 600x400 take 50 to 90.
_MOST_STEPS = 300


class Lime(nn.Module):
    """S / T^gamma, T the refined illumination: (B, 3, H, W) in [0, 1] -> the same; computed on the CPU.

    alpha: weight of smoothness. sigma: of the Gaussian window in the weights, pixels. epsilon: keeps the weights, and
    T, away from 1 / 0. gamma: exponent of T; 1 would take all light out. tolerance: relative error at which the
    solver stops; at 1e-5 T is within .1 % everywhere, .002 % on average.
    """

    def __init__(
        self,
        alpha: float = 0.15,
        sigma: float = 2.0,
        epsilon: float = 1e-3,
        gamma: float = 0.8,
        tolerance: float = 1e-5,
    ) -> None:
        super().__init__()
        if not (alpha >= 0 and sigma > 0 and epsilon > 0 and 0 < gamma <= 1 and 0 < tolerance < 1):
            raise UserError(
                "lime needs alpha from 0, sigma and epsilon above 0, gamma above 0 and up to 1, and tolerance between "
                f"0 and 1; got {alpha}, {sigma}, {epsilon}, {gamma}, {tolerance}"
            )
        self.alpha = alpha
        self.sigma = sigma
        self.epsilon = epsilon
        self.gamma = gamma
        self.tolerance = tolerance

    def forward(self, image: Tensor, record: Sequence[Darkening] | None = None) -> Tensor:  # noqa: ARG002
        return torch.stack([self._one(one) for one in image.detach().float().cpu()]).to(image)

    def _one(self, image: Tensor) -> Tensor:
        light = self.illumination(image.max(0).values.numpy())
        return (image / torch.from_numpy(light**self.gamma)).clamp(0, 1)

    def illumination(self, brightest: np.ndarray) -> np.ndarray:
        """T (H, W), at least epsilon, of T0 = max(R, G, B) (H, W) float32: (1 + alpha sum_d D_d' W_d D_d) T = T0."""
        weights = [self.alpha * structure_weights(along, self.sigma, self.epsilon) for along in gradient(brightest)]
        system = GridSystem(np.ones_like(brightest), *weights)
        refined = solve(system, brightest, tolerance=self.tolerance, most=_MOST_STEPS).u
        return refined.clip(self.epsilon, 1)


def structure_weights(along: np.ndarray, sigma: float, epsilon: float) -> np.ndarray:
    """W_d = G*1 / (|G*D_d T0| + epsilon) / (|D_d T0| + epsilon) of the differences D_d T0, of the same shape.

    Large where differences cancel within the window (texture, noise), small where they add up (an edge): the
    absolute value comes after the smoothing. G: a Gaussian over 3 sigma each way, of sum 1, zero beyond the border.
    """
    kernel = cv2.getGaussianKernel(2 * int(np.ceil(3 * sigma)) + 1, sigma, cv2.CV_32F)

    def smooth(values: np.ndarray) -> np.ndarray:
        return cv2.sepFilter2D(values, -1, kernel, kernel, borderType=cv2.BORDER_CONSTANT)

    return smooth(np.ones_like(along)) / (np.abs(smooth(along)) + epsilon) / (np.abs(along) + epsilon)
