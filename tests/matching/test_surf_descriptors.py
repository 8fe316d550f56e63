import math

import numpy as np
import pytest

from diffnav.matching.surf_blobs import Blobs
from diffnav.matching.surf_descriptors import describe, longest_windows, orientations
from diffnav.matching.surf_integral import haar_responses, integral_image


@pytest.fixture(scope="module")
def grey():
    """A smooth random picture, (70, 80) uint8."""
    noise = np.random.default_rng(1).normal(size=(70, 80))
    spectrum = np.fft.rfft2(noise)
    frequency = np.hypot(np.fft.fftfreq(70)[:, None], np.fft.rfftfreq(80))
    smooth = np.fft.irfft2(spectrum * np.exp(-((frequency * 12) ** 2)), (70, 80))
    return (255 * (smooth - smooth.min()) / np.ptp(smooth)).round().astype(np.uint8)


def blobs_at(*rows):
    x, y, scale = np.array(rows, float).T
    return Blobs(x, y, scale, np.ones(len(x)))


def slow_box(grey, left, right, upper, lower):
    """The sum over a rectangle, each pixel by the part of its square that it covers; the border's pixels repeat."""
    height, width = grey.shape
    total = 0.0
    for row in range(math.floor(upper), math.ceil(lower) + 1):
        for column in range(math.floor(left), math.ceil(right) + 1):
            covered_x = max(0.0, min(right, column + 0.5) - max(left, column - 0.5))
            covered_y = max(0.0, min(lower, row + 0.5) - max(upper, row - 0.5))
            total += covered_x * covered_y * grey[min(max(row, 0), height - 1), min(max(column, 0), width - 1)]
    return total


def slow_haar(grey, x, y, half):
    right_less_left = slow_box(grey, x, x + half, y - half, y + half) - slow_box(grey, x - half, x, y - half, y + half)
    lower_less_upper = slow_box(grey, x - half, x + half, y, y + half) - slow_box(grey, x - half, x + half, y - half, y)
    return right_less_left, lower_less_upper


def slow_orientation(grey, x, y, s):
    responses = []
    for j in range(-6, 7):
        for i in range(-6, 7):
            if i * i + j * j <= 36:
                dx, dy = slow_haar(grey, x + i * s, y + j * s, 2 * s)
                weight = math.exp(-(i * i + j * j) / 8)
                responses.append((weight * dx, weight * dy))
    return slow_window(responses)


def slow_window(responses):
    longest, direction = -1.0, None
    for start in responses:
        sums = [0.0, 0.0]
        for dx, dy in responses:
            if (math.atan2(dy, dx) - math.atan2(start[1], start[0])) % (2 * math.pi) < math.pi / 3:
                sums[0] += dx
                sums[1] += dy
        if math.hypot(*sums) > longest:
            longest, direction = math.hypot(*sums), math.atan2(sums[1], sums[0])
    return direction


def slow_descriptor(grey, x, y, s, direction, extended):
    cos, sin = math.cos(direction), math.sin(direction)
    values = []
    for part_y in range(4):
        for part_x in range(4):
            sums = [0.0] * (8 if extended else 4)
            for j in range(5):
                for i in range(5):
                    u, v = 5 * part_x + i - 9.5, 5 * part_y + j - 9.5
                    along, across = slow_haar(grey, x + s * (u * cos - v * sin), y + s * (u * sin + v * cos), s)
                    weight = math.exp(-(u * u + v * v) / (2 * 3.3 * 3.3))
                    dx, dy = weight * (cos * along + sin * across), weight * (cos * across - sin * along)
                    if extended:
                        of_dx, of_dy = (0 if dy >= 0 else 2), (4 if dx >= 0 else 6)
                        sums[of_dx] += dx
                        sums[of_dx + 1] += abs(dx)
                        sums[of_dy] += dy
                        sums[of_dy + 1] += abs(dy)
                    else:
                        for k, term in enumerate((dx, dy, abs(dx), abs(dy))):
                            sums[k] += term
            values += sums
    length = math.sqrt(sum(value * value for value in values))
    return [value / length for value in values]


# The last reaches beyond the picture on two sides.
PLACES = [(40.0, 35.0, 1.6), (37.3, 30.8, 2.45), (50.62, 41.17, 3.1), (9.4, 61.7, 2.2)]


@pytest.mark.parametrize(("x", "y", "half"), [(30, 20, 3), (30.5, 20.5, 2), (33.37, 41.92, 2.71), (-3.4, 68.2, 4.6)])
def test_haar_responses_are_direct_sums(grey, x, y, half):
    found = haar_responses(integral_image(grey), np.array([x]), np.array([y]), np.array([half]))
    expected = slow_haar(grey, x, y, half)
    assert [found[0].item(), found[1].item()] == pytest.approx(expected, abs=1e-6)


def test_haar_responses_know_right_from_left_and_below_from_above():
    ramp = np.add.outer(3 * np.arange(30), 2 * np.arange(40)).astype(np.uint8)
    dx, dy = haar_responses(integral_image(ramp), np.array([20.2]), np.array([14.7]), np.array([2.0]))
    # Halves 2 x 4 px whose centres lie 2 px apart.
    assert dx.item() == pytest.approx(2 * 2 * 8)
    assert dy.item() == pytest.approx(3 * 2 * 8)


@pytest.mark.parametrize("place", PLACES)
def test_orientation_by_plain_loops(grey, place):
    found = orientations(integral_image(grey), blobs_at(place))
    assert found.item() == pytest.approx(slow_orientation(grey, *place), abs=1e-6)


@pytest.mark.parametrize("extended", [False, True])
@pytest.mark.parametrize(("place", "direction"), list(zip(PLACES, (0.0, 0.7, -2.3, 3.0), strict=True)))
def test_descriptor_by_plain_loops(grey, place, direction, extended):
    found = describe(integral_image(grey), blobs_at(place), np.array([direction]), extended)
    expected = slow_descriptor(grey, *place, direction, extended)
    assert found.shape == (1, 128 if extended else 64)
    np.testing.assert_allclose(found[0], expected, atol=1e-7)


def test_many_blobs_are_described_as_each_alone(grey):
    dice = np.random.default_rng(2)
    rows = np.stack([dice.uniform(0, 79, 60), dice.uniform(0, 69, 60), dice.uniform(1.5, 4, 60)], 1)
    sums = integral_image(grey)
    together = orientations(sums, blobs_at(*rows))
    alone = [orientations(sums, blobs_at(row)).item() for row in rows]
    np.testing.assert_allclose(together, alone, atol=1e-9)
    descriptors = describe(sums, blobs_at(*rows), together)
    np.testing.assert_allclose(np.linalg.norm(descriptors, axis=1), 1)
    np.testing.assert_allclose(descriptors[57], describe(sums, blobs_at(rows[57]), together[57:58])[0], atol=1e-12)


@pytest.mark.parametrize("direction_deg", [0, 37, 90, 135, 180, 250])
def test_a_ramps_orientation_is_its_gradients(direction_deg):
    y, x = np.mgrid[:61, :61] - 30.0
    angle = math.radians(direction_deg)
    ramp = (127 + 2.5 * (math.cos(angle) * x + math.sin(angle) * y)).round().astype(np.uint8)
    found = orientations(integral_image(ramp), blobs_at((30, 30, 2))).item()
    assert abs((math.degrees(found) - direction_deg + 180) % 360 - 180) < 1


def test_windows_are_searched_all_around():
    dx, dy = np.random.default_rng(3).normal(size=(2, 40, 30))
    expected = [slow_window(list(zip(*vectors, strict=True))) for vectors in zip(dx, dy, strict=True)]
    np.testing.assert_allclose(longest_windows(dx, dy), expected, atol=1e-9)
    # Two at 170 and -170 degrees make a window that passes 180; one at 0 is shorter than both.
    angles = np.radians([[170.0, -170.0, 0.0]])
    found = longest_windows(np.cos(angles) * [1, 1, 1.5], np.sin(angles) * [1, 1, 1.5])
    assert abs(math.degrees(found.item())) == pytest.approx(180)


@pytest.mark.parametrize("level", [0, 77])
def test_a_flat_picture_is_described_without_a_complaint(level):
    sums = integral_image(np.full((50, 60), level, np.uint8))
    blobs = blobs_at((30, 25, 2.3), (2, 3, 3.1))
    directions = orientations(sums, blobs)
    assert np.isfinite(directions).all()
    assert np.isfinite(describe(sums, blobs, directions)).all()
