"""Bootstrap intervals of the area under the recall curve of homography errors, and of its paired differences."""

from collections.abc import Sequence

import numpy as np

from diffnav.evaluation.bootstrap import percentiles, resamples
from diffnav.evaluation.homography_auc import homography_auc


def auc_interval(
    errors_px: Sequence[float], threshold_px: float, seed: int = 0, level: float = 0.95, draws: int = 10_000
) -> tuple[float, float]:
    """(low, high) of `homography_auc` at one threshold over resampled pairs; failures are infinite errors."""
    errors = np.asarray(errors_px, dtype=np.float64)
    return percentiles([_areas(errors[drawn], threshold_px) for drawn in resamples(errors.size, seed, draws)], level)


def auc_difference(
    errors_px: Sequence[float],
    reference_px: Sequence[float],
    threshold_px: float,
    seed: int = 0,
    level: float = 0.95,
    draws: int = 10_000,
) -> tuple[float, float, float]:
    """(mean, low, high): the area of `errors_px` minus that of `reference_px`, of the same pairs in the same order.

    Raises: ValueError if the two differ in length.
    """
    if len(errors_px) != len(reference_px):
        raise ValueError(f"paired errors must be equally many, got {len(errors_px)} and {len(reference_px)}")
    ours, theirs = (np.asarray(errors, dtype=np.float64) for errors in (errors_px, reference_px))
    portions = [
        _areas(ours[drawn], threshold_px) - _areas(theirs[drawn], threshold_px)
        for drawn in resamples(ours.size, seed, draws)
    ]
    both = (homography_auc(errors, [threshold_px])[0] for errors in (ours.tolist(), theirs.tolist()))
    return (next(both) - next(both), *percentiles(portions, level))


def _areas(errors: np.ndarray, threshold_px: float) -> np.ndarray:
    """`homography_auc` of each row of errors (k, n): (k,).

    The trapezoids are the step curve's area, the mean of max(0, 1 - e / threshold), and half a step of the recall
    up to the last error below the threshold.
    """
    below = np.where(errors < threshold_px, errors, 0.0)
    steps = np.where(errors < threshold_px, 1 - below / threshold_px, 0.0).mean(1)
    return steps + below.max(1) / (2 * errors.shape[1] * threshold_px)
