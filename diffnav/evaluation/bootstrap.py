"""Seeded percentile bootstrap: how far a mean over images may be off (Efron 1979)."""

from collections.abc import Iterator, Sequence

import numpy as np

# Resampled values held at once: bounds the memory on large image sets.
_PORTION = 2_000_000


def mean_interval(
    values: Sequence[float] | np.ndarray, seed: int = 0, level: float = 0.95, draws: int = 10_000
) -> tuple[float, float]:
    """(low, high): the percentile interval that holds the mean of the population with probability `level`.

    A pure function of the values and `seed`; a single value gives an interval of no width.

    Raises: ValueError for no values or values that are not finite.
    """
    sample = np.asarray(values, dtype=np.float64)
    if sample.ndim != 1 or sample.size == 0 or not np.isfinite(sample).all():
        raise ValueError(f"need one or more finite values, got {sample.size} of which some are not")
    return percentiles([sample[drawn].mean(1) for drawn in resamples(sample.size, seed, draws)], level)


def resamples(count: int, seed: int, draws: int) -> Iterator[np.ndarray]:
    """Portions (k, count) of `draws` rows of indices, each row drawn from range(count) with replacement."""
    dice = np.random.default_rng(seed)
    portion = max(1, _PORTION // count)
    for start in range(0, draws, portion):
        yield dice.integers(count, size=(min(portion, draws - start), count))


def percentiles(portions: Sequence[np.ndarray], level: float) -> tuple[float, float]:
    """(low, high): what the middle share `level` of a resampled statistic, given in portions, lies between."""
    low, high = np.quantile(np.concatenate(portions), [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)


def paired_difference(
    values: Sequence[float], reference: Sequence[float], seed: int = 0, level: float = 0.95, draws: int = 10_000
) -> tuple[float, float, float]:
    """(mean, low, high) of `values` minus `reference`, both measured on the same images in the same order.

    Raises: ValueError if the two differ in length.
    """
    if len(values) != len(reference):
        raise ValueError(f"paired values must be equally many, got {len(values)} and {len(reference)}")
    differences = np.asarray(values, dtype=np.float64) - np.asarray(reference, dtype=np.float64)
    return (float(differences.mean()), *mean_interval(differences, seed, level, draws))
