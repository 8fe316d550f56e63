import math

import numpy as np
import pytest

from diffnav.evaluation.homography_auc import homography_auc


def step_area(errors, threshold, steps=200_000):
    """The recall curve, a staircase, integrated as a sum of thin strips, over the threshold."""
    at = (np.arange(steps) + 0.5) / steps * threshold
    return float((np.asarray(errors)[:, None] <= at).mean())


def test_by_hand():
    # (0, 0) (1, 1/3) (2, 2/3), level to 4: triangles and rectangles of 1/6 + 1/2 + 4/3 = 2; up to 1.5: 1/6 + 1/6.
    assert homography_auc([2, math.inf, 1], [4, 1.5]) == pytest.approx([2 / 4, (1 / 6 + 1 / 6) / 1.5])


@pytest.mark.parametrize("threshold", [1.0, 3.0, 5.0])
def test_exceeds_the_exact_step_area_by_half_a_step(threshold):
    errors = [0.2, 0.7, 0.9, 2.4, 2.6, 3.7, 12.0, math.inf]
    last = max(error for error in errors if error < threshold)
    expected = step_area(errors, threshold) + last / (2 * len(errors) * threshold)
    assert homography_auc(errors, [threshold])[0] == pytest.approx(expected, abs=1e-5)


def test_perfect_and_hopeless():
    assert homography_auc([0.0, 0.0, 0.0], [1, 3, 5]) == [1, 1, 1]
    assert homography_auc([math.inf, math.inf], [1, 3, 5]) == [0, 0, 0]
    assert homography_auc([7.0], [5]) == [0]


def test_a_failure_stays_in_the_denominator():
    whole, halved = homography_auc([1.0, 2.0], [3])[0], homography_auc([1.0, 2.0, math.inf, math.inf], [3])[0]
    assert halved == pytest.approx(whole / 2)


def test_order_does_not_matter_and_a_larger_error_costs():
    assert homography_auc([0.5, 2.0, 1.0], [3]) == homography_auc([1.0, 0.5, 2.0], [3])
    areas = [homography_auc([0.5, error], [3])[0] for error in (0.6, 1.0, 2.0, 2.9, 3.1)]
    assert areas == sorted(areas, reverse=True)


@pytest.mark.parametrize("errors", [[], [1.0, -0.1], [math.nan]])
def test_errors_that_are_none_are_refused(errors):
    with pytest.raises(ValueError, match="need one or more errors"):
        homography_auc(errors, [1])


@pytest.mark.parametrize("threshold", [0, -1, math.inf, math.nan])
def test_thresholds_without_an_area_are_refused(threshold):
    with pytest.raises(ValueError, match="threshold"):
        homography_auc([1.0], [threshold])
