"""Sums and means over windows, against loops."""

import numpy as np
import pytest

from diffnav.enhancers.windows import window_mean, window_sum


@pytest.mark.parametrize("size", [(1, 9), (5, 5), (15, 3)])
def test_windows_end_at_the_border(size: tuple[int, int]) -> None:
    values = np.random.default_rng(0).random((12, 10)).astype(np.float32)
    half = size[0] // 2, size[1] // 2
    total, mean = window_sum(values, size), window_mean(values, size)
    for y in range(12):
        for x in range(10):
            window = values[max(0, y - half[0]) : y + half[0] + 1, max(0, x - half[1]) : x + half[1] + 1]
            assert total[y, x] == pytest.approx(window.sum(), rel=1e-5)
            assert mean[y, x] == pytest.approx(window.mean(), rel=1e-5)


def test_channels_are_summed_apart() -> None:
    values = np.random.default_rng(0).random((7, 8, 2)).astype(np.float32)
    both = window_sum(values, (3, 3))
    assert np.array_equal(both[..., 1], window_sum(np.ascontiguousarray(values[..., 1]), (3, 3)))
