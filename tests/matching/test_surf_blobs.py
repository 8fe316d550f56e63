import math

import numpy as np
import pytest

from diffnav.matching.surf_blobs import filter_sizes, find_blobs, hessian_determinant, peak_cubes, quadratic_peaks
from diffnav.matching.surf_integral import integral_image

# The 9 x 9 filters as the article draws them: Dxx is Dyy with x and y exchanged.
DYY_9 = [[0, 0, 1, 1, 1, 1, 1, 0, 0]] * 3 + [[0, 0, -2, -2, -2, -2, -2, 0, 0]] * 3 + [[0, 0, 1, 1, 1, 1, 1, 0, 0]] * 3
DXY_9 = [
    [0, 0, 0, 0, 0, 0, 0, 0, 0],
    [0, 1, 1, 1, 0, -1, -1, -1, 0],
    [0, 1, 1, 1, 0, -1, -1, -1, 0],
    [0, 1, 1, 1, 0, -1, -1, -1, 0],
    [0, 0, 0, 0, 0, 0, 0, 0, 0],
    [0, -1, -1, -1, 0, 1, 1, 1, 0],
    [0, -1, -1, -1, 0, 1, 1, 1, 0],
    [0, -1, -1, -1, 0, 1, 1, 1, 0],
    [0, 0, 0, 0, 0, 0, 0, 0, 0],
]


def slow_filters(size):
    """Dyy and Dxy of any size, pixel by pixel: lobes a third of the size, less one pixel for the width of Dyy's two."""
    lobe, half = size // 3, size // 2
    dyy, dxy = np.zeros((size, size)), np.zeros((size, size))
    for y in range(size):
        for x in range(size):
            if abs(x - half) < lobe:
                dyy[y, x] = -2 if lobe <= y < 2 * lobe else 1
            if 1 <= abs(x - half) <= lobe and 1 <= abs(y - half) <= lobe:
                dxy[y, x] = 1 if (x < half) == (y < half) else -1
    return dyy, dxy


def slow_determinant(grey, size, y, x):
    dyy, dxy = slow_filters(size)
    half = size // 2
    sums = [0.0, 0.0, 0.0]
    for i in range(size):
        for j in range(size):
            value = grey[y - half + i, x - half + j] / 255 / size**2
            sums[0] += dyy[j, i] * value
            sums[1] += dyy[i, j] * value
            sums[2] += dxy[i, j] * value
    return sums[0] * sums[1] - (0.9 * sums[2]) ** 2


def gaussian_blob(centre, sigma, size=(220, 240), level=200.0):
    y, x = np.mgrid[: size[0], : size[1]]
    blob = np.exp(-((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / (2 * sigma**2))
    return (20 + level * blob).round().astype(np.uint8)


def strongest(grey):
    blobs = find_blobs(integral_image(grey), 500)
    return np.array([blobs.x[0], blobs.y[0]]), blobs.scale[0]


def test_filters_are_the_articles():
    dyy, dxy = slow_filters(9)
    np.testing.assert_array_equal(dyy, DYY_9)
    np.testing.assert_array_equal(dxy, DXY_9)
    octaves = [filter_sizes(octave) for octave in range(4)]
    assert octaves == [(9, 15, 21, 27), (15, 27, 39, 51), (27, 51, 75, 99), (51, 99, 147, 195)]


@pytest.mark.parametrize(("size", "step", "margin"), [(9, 1, 4), (15, 1, 8), (21, 3, 10), (27, 2, 13)])
def test_determinants_are_direct_sums(size, step, margin):
    grey = np.random.default_rng(size).integers(0, 256, (37, 41)).astype(np.uint8)
    expected = [
        [slow_determinant(grey, size, y, x) for x in range(margin, 41 - margin, step)]
        for y in range(margin, 37 - margin, step)
    ]
    found = hessian_determinant(integral_image(grey), size, step, margin)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-9)


def test_integral_image_by_hand():
    grey = np.array([[1, 2, 3], [4, 5, 250]], np.uint8)
    assert integral_image(grey).tolist() == [[0, 0, 0, 0], [0, 1, 3, 6], [0, 5, 12, 265]]


@pytest.mark.parametrize("sigma", [3.0, 4.5, 7.0, 10.0])
@pytest.mark.parametrize("bright", [True, False])
def test_an_ideal_blob_is_found_where_it_is(sigma, bright):
    errors, scales = [], []
    for centre in np.random.default_rng(5).uniform(105, 115, (12, 2)):
        grey = gaussian_blob(centre, sigma)
        place, scale = strongest(grey if bright else 255 - grey)
        errors.append(place - centre)
        scales.append(scale)
    assert np.abs(errors).max() < 0.1
    # A half-pixel slip in the convention would show here, a quarter of a pixel too.
    assert np.abs(np.mean(errors, 0)).max() < 0.03
    # Filters of lobe L blur like a Gaussian of L / 2 along and L / sqrt(3) across the lobes, while s = .4 L.
    assert np.mean(scales) / sigma == pytest.approx(0.4 / math.sqrt(0.5 / math.sqrt(3)), abs=0.06)


def test_one_blob_is_one_blob_though_octaves_overlap():
    # From 21 to 27 px both octaves have a filter around which they can find a peak.
    for sigma in np.linspace(3, 4.5, 7):
        blobs = find_blobs(integral_image(gaussian_blob((110.3, 109.6), sigma)), 500)
        near = np.hypot(blobs.x - 110.3, blobs.y - 109.6) < blobs.scale[0]
        assert near.sum() == 1


def test_blobs_keep_their_distance():
    grey = np.random.default_rng(2).integers(0, 256, (120, 150)).astype(np.uint8)
    blobs = find_blobs(integral_image(grey), 10_000)
    assert len(blobs.x) > 200
    distance = np.hypot(blobs.x[:, None] - blobs.x, blobs.y[:, None] - blobs.y)
    np.fill_diagonal(distance, np.inf)
    assert (distance >= np.minimum(blobs.scale[:, None], blobs.scale)).all()


def test_fewer_are_the_strongest_of_many():
    grey = np.random.default_rng(3).integers(0, 256, (120, 150)).astype(np.uint8)
    many, few = (find_blobs(integral_image(grey), most) for most in (10_000, 40))
    assert (np.diff(many.response) <= 0).all()
    for all_of_them, first in zip(many, few, strict=True):
        np.testing.assert_array_equal(all_of_them[:40], first)
    threshold = many.response[99]
    assert (find_blobs(integral_image(grey), 10_000, threshold=threshold).response > threshold).all()
    assert len(find_blobs(integral_image(grey), 10_000, threshold=threshold).x) == 99


def test_contrast_changes_responses_but_no_place():
    grey = np.random.default_rng(4).integers(0, 85, (90, 110)).astype(np.uint8)
    weak, strong = find_blobs(integral_image(grey), 10_000), find_blobs(integral_image(3 * grey), 10_000)
    np.testing.assert_allclose(strong.response, 9 * weak.response, rtol=1e-5)
    np.testing.assert_allclose(strong.x, weak.x, atol=1e-4)
    np.testing.assert_allclose(strong.y, weak.y, atol=1e-4)
    shifted = find_blobs(integral_image(3 * grey + np.uint8(3)), 10_000)
    np.testing.assert_array_equal(shifted.x, strong.x)


def test_octaves_that_do_not_fit_are_left_out():
    dice = np.random.default_rng(6)
    for size in ((1, 1), (28, 400), (400, 28)):
        assert len(find_blobs(integral_image(dice.integers(0, 256, size).astype(np.uint8)), 500).x) == 0
    grey = dice.integers(0, 256, (90, 100)).astype(np.uint8)
    one, four = (find_blobs(integral_image(grey), 500, octaves) for octaves in (1, 4))
    # Peaks lie between the first and the last filter; the third octave's 99 px do not fit.
    assert one.scale.min() > 9 * 1.2 / 9
    assert one.scale.max() < 27 * 1.2 / 9 < four.scale.max() < 51 * 1.2 / 9


def test_of_equal_neighbours_one_is_the_peak():
    layers = np.zeros((3, 5, 6), np.float32)
    layers[1, 2, 2] = layers[1, 2, 3] = 0.5
    cubes, where = peak_cubes(layers, 0.0)
    assert where.tolist() == [[1, 2, 2]]
    assert cubes.shape == (1, 3, 3, 3)
    assert cubes[0, 1, 1].tolist() == [0, 0.5, 0.5]
    assert len(peak_cubes(layers, 0.5)[1]) == 0
    assert len(peak_cubes(np.full((4, 9, 9), 0.3, np.float32), 0.0)[1]) == 0


def test_quadratic_fit_is_exact_for_a_quadratic():
    dice = np.random.default_rng(7)
    at = np.stack(np.meshgrid(*[np.arange(-1, 2)] * 3, indexing="ij"), -1).astype(float)
    peaks = dice.uniform(-0.9, 0.9, (20, 3))
    cubes = []
    for peak in peaks:
        root = dice.normal(size=(3, 3))
        shape = root @ root.T + np.eye(3)
        cubes.append(3 - np.einsum("...i,ij,...j->...", at - peak, shape, at - peak))
    offset, exists = quadratic_peaks(np.stack(cubes))
    np.testing.assert_allclose(offset, peaks, atol=1e-9)
    assert exists.all()


def test_what_peaks_elsewhere_or_nowhere_is_none():
    at = np.stack(np.meshgrid(*[np.arange(-1, 2)] * 3, indexing="ij"), -1).astype(float)
    away = -((at - [0, 0, 1.2]) ** 2).sum(-1)
    ridge = -(at[..., 0] ** 2) - at[..., 1] ** 2
    _, exists = quadratic_peaks(np.stack([away, ridge, np.ones((3, 3, 3))]))
    assert exists.tolist() == [False, False, False]
    assert quadratic_peaks(np.zeros((0, 3, 3, 3)))[0].shape == (0, 3)
