"""The grid's matrix and its solver against dense algebra; the multigrid cycle as a preconditioner."""

import numpy as np
import pytest

from diffnav.enhancers.weighted_least_squares import (
    GridSystem,
    Multigrid,
    adjoint_gradient,
    block_sums,
    gradient,
    jacobi,
    solve,
)


def weights(height: int, width: int, seed: int = 0, decades: float = 5.0) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the pairs to the right and downwards, from 1 to 10^decades side by side."""
    dice = np.random.default_rng(seed)
    return 10 ** dice.uniform(0, decades, (height, width - 1)), 10 ** dice.uniform(0, decades, (height - 1, width))


def dense_matrix(mass: np.ndarray, weight_x: np.ndarray, weight_y: np.ndarray) -> np.ndarray:
    """The matrix pair by pair: each adds weight (u_p - u_q)^2 to the energy."""
    height, width = mass.shape
    matrix = np.diag(mass.ravel()).astype(np.float64)
    for y in range(height):
        for x in range(width):
            for other, weight in (
                ((y, x + 1), weight_x[y, x] if x + 1 < width else None),
                ((y + 1, x), weight_y[y, x] if y + 1 < height else None),
            ):
                if weight is not None:
                    p, q = y * width + x, other[0] * width + other[1]
                    matrix[p, p] += weight
                    matrix[q, q] += weight
                    matrix[p, q] -= weight
                    matrix[q, p] -= weight
    return matrix


def test_the_product_is_that_of_the_dense_matrix() -> None:
    dice = np.random.default_rng(1)
    mass, (weight_x, weight_y) = dice.uniform(0.5, 2, (5, 7)), weights(5, 7, decades=2)
    u = dice.normal(size=(5, 7))
    expected = dense_matrix(mass, weight_x, weight_y) @ u.ravel()
    system = GridSystem(mass, weight_x, weight_y)
    assert np.allclose((system @ u).ravel(), expected, rtol=1e-12)
    assert np.allclose(system.dense(), dense_matrix(mass, weight_x, weight_y), rtol=1e-12)


def test_gradient_and_adjoint_are_transposes() -> None:
    dice = np.random.default_rng(2)
    u, flow_x, flow_y = dice.normal(size=(4, 6)), dice.normal(size=(4, 5)), dice.normal(size=(3, 6))
    along_x, along_y = gradient(u)
    assert along_x[2, 3] == u[2, 4] - u[2, 3]
    assert along_y[2, 3] == u[3, 3] - u[2, 3]
    assert np.vdot(along_x, flow_x) + np.vdot(along_y, flow_y) == pytest.approx(
        np.vdot(u, adjoint_gradient(flow_x, flow_y))
    )


@pytest.mark.parametrize("size", [(12, 16), (13, 17), (1, 40), (40, 2), (16, 5)])
@pytest.mark.parametrize(("dtype", "error"), [(np.float64, 1e-6), (np.float32, 1e-4)])
def test_the_solution_is_the_dense_one(size: tuple[int, int], dtype: type, error: float) -> None:
    dice = np.random.default_rng(3)
    b, (weight_x, weight_y) = dice.uniform(0, 1, size), weights(*size)
    expected = np.linalg.solve(dense_matrix(np.ones(size), weight_x, weight_y), b.ravel()).reshape(size)
    system = GridSystem(np.ones(size, dtype), weight_x.astype(dtype), weight_y.astype(dtype))
    solution = solve(system, b.astype(dtype), tolerance=error / 100)
    assert solution.error <= error / 100
    assert solution.u.dtype == dtype
    assert np.abs(solution.u / expected - 1).max() < error


def test_a_coarse_system_moves_blocks_as_one() -> None:
    """Galerkin: P' A P with P that copies a block's value to its four pixels, fewer at an odd end."""
    size = (5, 8)
    mass, (weight_x, weight_y) = np.random.default_rng(4).uniform(1, 2, size), weights(*size, decades=1)
    copies = np.zeros((40, 12))
    for y in range(5):
        for x in range(8):
            copies[y * 8 + x, y // 2 * 4 + x // 2] = 1
    expected = copies.T @ dense_matrix(mass, weight_x, weight_y) @ copies
    assert np.allclose(GridSystem(mass, weight_x, weight_y).coarse().dense(), expected, rtol=1e-12)
    assert np.allclose(block_sums(mass).ravel(), copies.T @ mass.ravel())


@pytest.mark.parametrize("size", [(15, 18), (9, 21)])
def test_a_cycle_is_symmetric_and_positive(size: tuple[int, int]) -> None:
    """What conjugate gradients require of a preconditioner; and far nearer to the inverse than the diagonal is."""
    system = GridSystem(np.ones(size), *weights(*size, decades=4))
    unit = np.eye(size[0] * size[1]).reshape(-1, *size)
    conditions = []
    for precondition in (Multigrid(system), jacobi(system)):
        matrix = np.stack([precondition(one).ravel() for one in unit])
        assert np.allclose(matrix, matrix.T, atol=1e-12 * np.abs(matrix).max())
        assert np.linalg.eigvalsh(matrix).min() > 0
        lower = np.linalg.cholesky(matrix)
        spectrum = np.linalg.eigvalsh(lower.T @ system.dense() @ lower)
        conditions.append(spectrum.max() / spectrum.min())
    assert conditions[0] < conditions[1] / 20


def test_steps_hardly_grow_with_the_picture() -> None:
    steps = []
    for size in ((60, 80), (240, 320)):
        system = GridSystem(
            np.ones(size, np.float32), *(weight.astype(np.float32) for weight in weights(*size, decades=4))
        )
        b = np.random.default_rng(5).uniform(0, 1, size).astype(np.float32)
        steps.append(solve(system, b).steps)
    assert steps[1] < 1.5 * steps[0]
    assert steps[1] < 100


def test_the_stop_rule_and_its_bound() -> None:
    size = (30, 40)
    system, b = GridSystem(np.ones(size), *weights(*size)), np.random.default_rng(6).uniform(0, 1, size)
    exact = np.linalg.solve(system.dense(), b.ravel()).reshape(size)
    for tolerance in (1e-2, 1e-4, 1e-6):
        solution = solve(system, b, tolerance=tolerance)
        wrong = solution.u - exact
        energy = np.vdot(wrong, system @ wrong) / np.vdot(exact, b)
        assert solution.error <= tolerance
        # The cycle only stands for the inverse: the estimate may be off by the root of their condition number.
        assert np.sqrt(energy) < 10 * tolerance
    short = solve(system, b, tolerance=1e-6, most=3)
    assert short.steps == 3
    assert short.error > 1e-6


def test_a_good_start_saves_steps_and_stays_untouched() -> None:
    size = (30, 40)
    system, b = GridSystem(np.ones(size), *weights(*size)), np.random.default_rng(7).uniform(0, 1, size)
    exact = solve(system, b, tolerance=1e-9).u
    near = exact + 1e-4 * np.random.default_rng(8).normal(size=size)
    before = near.copy()
    assert solve(system, b, exact, tolerance=1e-5).steps == 0
    assert 0 < solve(system, b, near, tolerance=1e-5).steps < solve(system, b, tolerance=1e-5).steps
    assert np.array_equal(near, before)


def test_nothing_gives_nothing() -> None:
    system = GridSystem(np.ones((20, 20)), *weights(20, 20))
    assert solve(system, np.zeros((20, 20))).steps == 0
    assert not solve(system, np.zeros((20, 20))).u.any()
