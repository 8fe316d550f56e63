"""Weighted least squares on the pixel grid: (diag(m) + D_x' diag(w_x) D_x + D_y' diag(w_y) D_y) u = b.

D_x u and D_y u are the differences to the right and the lower neighbour; nothing lies beyond the border. SRIE and
LIME smooth their illumination like this, with weights that span five orders of magnitude: at 600x400 conjugate
gradients preconditioned by the diagonal need some 2,500 steps, with one multigrid cycle in its place 50 to 90.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

# Below this many unknowns the system is inverted outright.
_COARSEST = 64
# Damping of the Jacobi smoother; below 1, so that a cycle is positive definite, as conjugate gradients require.
_DAMPING = 0.8


class GridSystem:
    """The matrix above, never stored: five points a row.

    mass: (H, W), m > 0. weight_x: (H, W - 1), of the pair (y, x), (y, x + 1); weight_y: (H - 1, W), of the pair
    (y, x), (y + 1, x); both >= 0. All of one floating type.
    """

    def __init__(self, mass: np.ndarray, weight_x: np.ndarray, weight_y: np.ndarray) -> None:
        self.mass, self.weight_x, self.weight_y = mass, weight_x, weight_y
        self.diagonal = mass.copy()
        self.diagonal[:, :-1] += weight_x
        self.diagonal[:, 1:] += weight_x
        self.diagonal[:-1] += weight_y
        self.diagonal[1:] += weight_y

    def __matmul__(self, u: np.ndarray) -> np.ndarray:
        """The matrix times u (H, W), by differences of u: row by row, large weights would cancel badly in float32."""
        along_x, along_y = gradient(u)
        along_x *= self.weight_x
        along_y *= self.weight_y
        product = adjoint_gradient(along_x, along_y)
        product += self.mass * u
        return product

    def coarse(self) -> "GridSystem":
        """The system of blocks of 2 x 2 pixels that move as one (Galerkin): what joins two blocks adds up."""
        weight_x = self.weight_x[:, 1::2]
        weight_y = self.weight_y[1::2]
        return GridSystem(block_sums(self.mass), _pair_sums(weight_x), _pair_sums(weight_y.T).T)

    def dense(self) -> np.ndarray:
        """The matrix itself, (H W, H W)."""
        unit = np.eye(self.mass.size, dtype=self.mass.dtype).reshape(-1, *self.mass.shape)
        return np.stack([(self @ one).ravel() for one in unit])


def gradient(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """D_x u, (H, W - 1), and D_y u, (H - 1, W), of u (H, W)."""
    return u[:, 1:] - u[:, :-1], u[1:] - u[:-1]


def adjoint_gradient(flow_x: np.ndarray, flow_y: np.ndarray) -> np.ndarray:
    """D_x' flow_x + D_y' flow_y, (H, W), of the flows (H, W - 1) and (H - 1, W): what arrives less what leaves."""
    total = np.zeros((flow_x.shape[0], flow_y.shape[1]), flow_x.dtype)
    total[:, 1:] = flow_x
    total[:, :-1] -= flow_x
    total[1:] += flow_y
    total[:-1] -= flow_y
    return total


def block_sums(values: np.ndarray) -> np.ndarray:
    """Sums over blocks of 2 x 2, fewer at the end of an odd side: (H, W) -> (ceil(H / 2), ceil(W / 2))."""
    return _pair_sums(_pair_sums(values).T).T


def _pair_sums(values: np.ndarray) -> np.ndarray:
    """Sums of rows 0 and 1, 2 and 3, ...; an odd last row stands alone."""
    sums = values[::2].copy()
    sums[: len(values) // 2] += values[1::2]
    return sums


class Multigrid:
    """One V-cycle: a symmetric, positive definite stand-in for the inverse of a system's matrix.

    Each level damps what is rough by one step of Jacobi before and after the next, coarser one corrects the rest.
    Source: unsmoothed aggregation as a preconditioner, e.g. Notay 2010.
    """

    def __init__(self, system: GridSystem) -> None:
        self.systems = [system]
        while self.systems[-1].mass.size > _COARSEST:
            self.systems.append(self.systems[-1].coarse())
        self.smoothers = [_DAMPING / level.diagonal for level in self.systems]
        self.inverse = np.linalg.inv(self.systems[-1].dense().astype(np.float64)).astype(system.mass.dtype)

    def __call__(self, residual: np.ndarray, level: int = 0) -> np.ndarray:
        if level == len(self.systems) - 1:
            return (self.inverse @ residual.ravel()).reshape(residual.shape)
        system, smoother = self.systems[level], self.smoothers[level]
        u = smoother * residual
        correction = self(block_sums(residual - system @ u), level + 1)
        for rows in (u[::2], u[1::2]):
            rows[:, ::2] += correction[: len(rows)]
            rows[:, 1::2] += correction[: len(rows), : u.shape[1] // 2]
        u += smoother * (residual - system @ u)
        return u


def jacobi(system: GridSystem) -> Callable[[np.ndarray], np.ndarray]:
    """Division by the diagonal: enough, and cheaper, where the weights are small against the mass."""
    inverse = 1 / system.diagonal
    return lambda residual: inverse * residual


@dataclass(frozen=True)
class Solution:
    """u: (H, W). steps: conjugate-gradient steps taken. error: its estimated relative error in the energy norm."""

    u: np.ndarray
    steps: int
    error: float


def solve(
    system: GridSystem,
    b: np.ndarray,
    start: np.ndarray | None = None,
    tolerance: float = 1e-5,
    most: int = 200,
    preconditioner: Callable[[GridSystem], Callable[[np.ndarray], np.ndarray]] = Multigrid,
) -> Solution:
    """u with A u = b (H, W), by conjugate gradients, preconditioned with one multigrid cycle unless told otherwise.

    Stops once the estimated relative error, sqrt(r' M r / b' u) with M the preconditioner and r = b - A u, is at most
    `tolerance`, or after `most` steps. M stands for the inverse of A, so this is the error's energy norm over the
    solution's; float32 can reach it, while the plain residual stays large where weights are 1e5. start: a first
    guess, zero by default.
    """
    precondition = preconditioner(system)
    u = np.zeros_like(b) if start is None else start.copy()
    r = b.copy() if start is None else b - system @ u
    z = precondition(r)
    energy = float(np.vdot(r, z))
    p = z.copy()
    steps = 0
    while (error := _ratio(energy, float(np.vdot(b, u)))) > tolerance and steps < most:
        q = system @ p
        length = energy / float(np.vdot(p, q))
        u += length * p
        r -= length * q
        z = precondition(r)
        previous, energy = energy, float(np.vdot(r, z))
        p *= energy / previous
        p += z
        steps += 1
    return Solution(u, steps, error)


def _ratio(energy: float, scale: float) -> float:
    """sqrt(energy / scale); 0 without energy, even where rounding makes it negative; infinite without scale."""
    if energy <= 0:
        return 0.0
    return math.sqrt(energy / scale) if scale > 0 else math.inf
