"""Area under the recall curve of homography errors: how often, and how closely, a homography was found."""

from collections.abc import Sequence

import numpy as np


def homography_auc(errors_px: Sequence[float], thresholds_px: Sequence[float]) -> list[float]:
    """For each threshold the area under the recall curve up to it, over the threshold: in [0, 1], 1 is perfect.

    Recall at e is the share of pairs whose corner error is at most e. The convention is the field's, SuperGlue's
    `pose_auc` (Sarlin et al. 2020): straight lines between the points (error, recall) of the sorted errors, from
    (0, 0) on, level after the last error below the threshold (trapezoids). The exact integral of the empirical
    step curve, the mean of max(0, 1 - e / threshold), is smaller by the last such error / (2 n threshold).

    Args:
        errors_px: one per pair; a failure is infinite and stays in the denominator.
        thresholds_px: above 0.
    Raises: ValueError for no errors, an error that is negative or no number, a threshold that is not above 0.
    """
    errors = np.sort(np.asarray(errors_px, dtype=np.float64))
    if errors.ndim != 1 or errors.size == 0 or not (errors >= 0).all():
        raise ValueError(f"need one or more errors of 0 or more, infinite for a failure, got {list(errors_px)[:5]}")
    recall = np.arange(errors.size + 1) / errors.size
    areas = []
    for threshold in thresholds_px:
        if not 0 < threshold < np.inf:
            raise ValueError(f"a threshold must be above 0 and finite, got {threshold}")
        below = int((errors < threshold).sum())
        e = np.array([0.0, *errors[:below], threshold])
        r = np.array([*recall[: below + 1], recall[below]])
        areas.append(float(((r[1:] + r[:-1]) / 2 * np.diff(e)).sum() / threshold))
    return areas
