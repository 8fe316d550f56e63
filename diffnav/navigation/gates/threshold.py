"""The threshold that best tells dark pictures from normal ones by one number, and the ROC of all thresholds."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diffnav.errors import UserError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FittedThreshold:
    """A split of numbers, dark below `threshold`, and how it errs.

    balanced_accuracy: mean of the shares told rightly, of normal and of dark. dark_passed: share of the dark ones not
    below. normal_enhanced: share of the normal ones below. normal_count, dark_count: how many there were. auc: see
    `Roc`.
    """

    threshold: float
    balanced_accuracy: float
    dark_passed: float
    normal_enhanced: float
    normal_count: int
    dark_count: int
    auc: float


@dataclass(frozen=True)
class Roc:
    """Both shares below each threshold, from (0, 0) to (1, 1), and the area under the curve.

    thresholds: (K,), ascending, the last infinite. dark_enhanced, normal_enhanced: (K,) shares below. auc: the
    probability that a dark picture's number is the smaller one, ties counting half (Mann & Whitney).
    """

    thresholds: Array
    dark_enhanced: Array
    normal_enhanced: Array
    auc: float


def fit_threshold(normal_values: Sequence[float], dark_values: Sequence[float]) -> FittedThreshold:
    """The split with the highest balanced accuracy, midway between the two numbers that it parts.

    Of equally good splits the one in the widest gap is taken, of equally wide gaps the lowest.
    Raises: UserError if a side is empty, a number is not finite, or no split does better than chance.
    """
    normal, dark = _ascending("normal", normal_values), _ascending("dark", dark_values)
    splits, gaps = gap_middles(np.concatenate([normal, dark]))
    accuracies = (_shares_below(dark, splits) + 1 - _shares_below(normal, splits)) / 2
    if not len(splits) or accuracies.max() <= 0.5:
        raise UserError(
            "no threshold tells the dark pictures from the normal ones: they show as much definition; "
            "calibrate with pictures taken by day"
        )
    best = accuracies >= accuracies.max() - 1e-12
    return judge_threshold(float(splits[np.argmax(np.where(best, gaps, -1))]), normal, dark)


def judge_threshold(
    threshold: float, normal_values: Sequence[float] | Array, dark_values: Sequence[float] | Array
) -> FittedThreshold:
    """How a given threshold errs on these numbers. Raises: UserError if a side is empty or a number is not finite."""
    normal, dark = _ascending("normal", normal_values), _ascending("dark", dark_values)
    dark_passed = 1 - float(_shares_below(dark, np.array([threshold]))[0])
    normal_enhanced = float(_shares_below(normal, np.array([threshold]))[0])
    return FittedThreshold(
        threshold=threshold,
        balanced_accuracy=1 - (dark_passed + normal_enhanced) / 2,
        dark_passed=dark_passed,
        normal_enhanced=normal_enhanced,
        normal_count=len(normal),
        dark_count=len(dark),
        auc=roc(normal, dark).auc,
    )


def roc(normal_values: Sequence[float] | Array, dark_values: Sequence[float] | Array) -> Roc:
    """The receiver operating characteristic of "below the threshold is dark".

    Raises: UserError if a side is empty or a number is not finite.
    """
    normal, dark = _ascending("normal", normal_values), _ascending("dark", dark_values)
    thresholds = np.append(np.unique(np.concatenate([normal, dark])), np.inf)
    hits, alarms = _shares_below(dark, thresholds), _shares_below(normal, thresholds)
    auc = float(np.sum(np.diff(alarms) * (hits[1:] + hits[:-1]) / 2))
    return Roc(thresholds, hits, alarms, auc)


def gap_middles(values: Array) -> tuple[Array, Array]:
    """Between each two neighbours among the different values: the middle, above the lower one, and the distance."""
    distinct = np.unique(values)
    lower, upper = distinct[:-1], distinct[1:]
    # Neighbouring floats have nothing between them: the upper one itself then.
    return np.maximum(lower + (upper - lower) / 2, np.nextafter(lower, np.inf)), upper - lower


def _shares_below(ascending: Array, thresholds: Array) -> Array:
    return np.searchsorted(ascending, thresholds, side="left") / len(ascending)


def _ascending(kind: str, values: Sequence[float] | Array) -> Array:
    array = np.sort(np.asarray(values, dtype=np.float64))
    if array.ndim != 1 or not len(array) or not np.isfinite(array).all():
        raise UserError(f"need finite numbers of one or more {kind} pictures, got {array.size}; give more pictures")
    return array
