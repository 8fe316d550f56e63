"""SRIE (Fu et al. 2016): reflectance and illumination estimated together by a weighted variational model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from diffnav.darkness import Darkening
from diffnav.enhancers.weighted_least_squares import GridSystem, adjoint_gradient, gradient, jacobi, solve
from diffnav.errors import UserError

# Conjugate-gradient steps of one inner solve; photos at 600x400 take 2 to 25.
_MOST_STEPS = 200


class Srie(nn.Module):
    """R L^(1 / gamma) in HSV's value, hue and saturation kept: (B, 3, H, W) in [0, 1] -> the same; on the CPU.

    c1, c2: weights of the reflectance's and the illumination's gradients, for values of 0..255. penalty: lambda of
    the splitting. gamma: of the illumination. tolerance: relative change of R and of L at which the iterations end,
    at the latest after `iterations`. Photos darkened by gamma 3 to 5 reach 1e-3 only after some hundred; at the 30th
    the change is about 1e-2, and twenty more darken the result by .3 dB. solver_tolerance: relative error of each
    linear solve; 1e-4 keeps the result within about one of 255 levels.
    """

    def __init__(
        self,
        c1: float = 0.01,
        c2: float = 0.1,
        penalty: float = 1.0,
        gamma: float = 2.2,
        tolerance: float = 1e-3,
        iterations: int = 30,
        solver_tolerance: float = 1e-4,
    ) -> None:
        super().__init__()
        if not (c1 >= 0 and c2 >= 0 and penalty > 0 and gamma >= 1):
            raise UserError(
                "srie needs c1 and c2 from 0, penalty above 0 and gamma of 1 or more; "
                f"got {c1}, {c2}, {penalty}, {gamma}"
            )
        if not (tolerance >= 0 and iterations >= 1 and 0 < solver_tolerance < 1):
            raise UserError(
                "srie needs tolerance from 0, iterations of 1 or more and solver_tolerance between 0 and 1; "
                f"got {tolerance}, {iterations}, {solver_tolerance}"
            )
        self.c1 = c1
        self.c2 = c2
        self.penalty = penalty
        self.gamma = gamma
        self.tolerance = tolerance
        self.iterations = iterations
        self.solver_tolerance = solver_tolerance

    def forward(self, image: Tensor, record: Sequence[Darkening] | None = None) -> Tensor:  # noqa: ARG002
        return torch.stack([self._one(one) for one in image.detach().float().cpu()]).to(image)

    def _one(self, image: Tensor) -> Tensor:
        value = image.max(0).values
        parts = self.decompose(255 * value.numpy())
        enhanced = torch.from_numpy(parts.R * (parts.L / 255) ** (1 / self.gamma))
        # HSV with a new value: the channels keep their ratios, and black, which has none, turns grey.
        ratios = torch.where(value > 0, image / value.clamp(min=torch.finfo(value.dtype).tiny), 1.0)
        return (ratios * enhanced).clamp(0, 1)

    def decompose(self, value: np.ndarray) -> "Decomposition":
        """R in (0, 1] and L >= max(value, 1), with R L close to it, of value (H, W) float32 in 0..255.

        Minimises |r + l - s|^2 + c1 |R grad r|_1 + c2 |L grad l|^2 over r = log R and l = log L, s = log(value), by
        turns and with the R and L of the turn before as weights. Values below 1 count as 1: s needs a logarithm.
        """
        s = np.log(np.maximum(value, 1))
        r, l = np.zeros_like(s), s
        R, L = np.exp(r), np.exp(l)
        multipliers = [np.zeros_like(part) for part in gradient(s)]
        # The illumination before l >= s cuts into it is smooth: the better first guess for the next solve.
        uncut = s
        for iteration in range(1, self.iterations + 1):  # noqa: B007
            r, multipliers = self._reflectance(s - l, r, R, multipliers)
            system = GridSystem(np.ones_like(s), *(self.c2 * weight**2 for weight in _at_pairs(L)))
            uncut = solve(system, s - r, uncut, self.solver_tolerance, _MOST_STEPS).u
            l = np.maximum(uncut, s)
            R_before, L_before, R, L = R, L, np.exp(r), np.exp(l)
            change = max(_relative_change(R, R_before), _relative_change(L, L_before))
            if change <= self.tolerance:
                break
        return Decomposition(R, L, iteration, change)

    def _reflectance(
        self, target: np.ndarray, r: np.ndarray, R: np.ndarray, multipliers: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, list[np.ndarray]]:
        """The next r <= 0, and the next multipliers b, by one split Bregman step towards `target`, s - l."""
        weights = _at_pairs(R)
        d = [
            shrink(weight * slope + b, 1 / (2 * self.penalty))
            for weight, slope, b in zip(weights, gradient(r), multipliers, strict=True)
        ]
        strength = self.c1 * self.penalty
        flows = [strength * weight * (one - b) for weight, one, b in zip(weights, d, multipliers, strict=True)]
        system = GridSystem(np.ones_like(r), *(strength * weight**2 for weight in weights))
        # Weights of at most c1 penalty leave the matrix so close to 1 that its diagonal is preconditioner enough.
        solved = solve(system, target + adjoint_gradient(*flows), r, self.solver_tolerance, _MOST_STEPS, jacobi).u
        r = np.minimum(solved, 0)
        slopes = gradient(r)
        return r, [
            b + weight * slope - one for b, weight, slope, one in zip(multipliers, weights, slopes, d, strict=True)
        ]


@dataclass(frozen=True)
class Decomposition:
    """R, L: (H, W), L in 1..255. iterations: done. change: the larger relative change, of R or L, in the last one."""

    R: np.ndarray
    L: np.ndarray
    iterations: int
    change: float


def shrink(values: np.ndarray, threshold: float) -> np.ndarray:
    """Soft thresholding: values moved towards 0 by the threshold, and to 0 within it."""
    return values - values.clip(-threshold, threshold)


def _at_pairs(weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The weights of the differences to the right and downwards, (H, W - 1) and (H - 1, W): those of their pixel."""
    return weights[:, :-1], weights[:-1]


def _relative_change(now: np.ndarray, before: np.ndarray) -> float:
    return float(np.linalg.norm(now - before) / np.linalg.norm(before))
