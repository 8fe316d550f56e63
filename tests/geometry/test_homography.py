import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch.autograd import gradcheck

from diffnav.geometry.homography import (
    apply_homography,
    homography_corner_error_px,
    rotate_180,
    rotation_180,
)

H = torch.tensor([[1.1, -0.2, 14.0], [0.3, 0.9, -7.0], [2e-4, -1e-4, 1.0]], dtype=torch.float64)
POINTS = torch.tensor([[0.0, 0.0], [599.0, 0.0], [17.5, 321.25], [599.0, 399.0]], dtype=torch.float64)


def slow_transcription(H, points):
    mapped = []
    for x, y in points.tolist():
        u, v, w = (row[0] * x + row[1] * y + row[2] for row in H.tolist())
        mapped.append([u / w, v / w])
    return torch.tensor(mapped, dtype=torch.float64)


def test_equals_the_definition():
    torch.testing.assert_close(apply_homography(H, POINTS), slow_transcription(H, POINTS))


def test_identity_keeps_points_and_gives_float64():
    kept = apply_homography(torch.eye(3), POINTS.float())
    assert kept.dtype == torch.float64
    torch.testing.assert_close(kept, POINTS)


def test_the_inverse_undoes_it():
    torch.testing.assert_close(apply_homography(H.inverse(), apply_homography(H, POINTS)), POINTS)


def test_composition():
    other = torch.tensor([[0.0, -1.0, 30.0], [1.0, 0.0, 4.0], [-1e-4, 3e-4, 1.0]], dtype=torch.float64)
    torch.testing.assert_close(
        apply_homography(other @ H, POINTS), apply_homography(other, apply_homography(H, POINTS))
    )


@pytest.mark.parametrize("scale", [-1.0, 7.0, 1e-9])
def test_scale_of_the_matrix_does_not_matter(scale):
    torch.testing.assert_close(apply_homography(scale * H, POINTS), apply_homography(H, POINTS))


def test_batches_broadcast():
    matrices = torch.stack([H, torch.eye(3, dtype=torch.float64)])
    mapped = apply_homography(matrices, POINTS)
    assert mapped.shape == (2, 4, 2)
    torch.testing.assert_close(mapped[0], slow_transcription(H, POINTS))
    torch.testing.assert_close(mapped[1], POINTS)


def test_no_points():
    assert apply_homography(H, torch.zeros(0, 2)).shape == (0, 2)


def test_gradients():
    points = POINTS / 100
    assert gradcheck(apply_homography, (H.clone().requires_grad_(), points.clone().requires_grad_()))


def test_a_point_sent_to_infinity_is_far_away_but_finite_with_finite_gradients():
    horizon = torch.tensor([[1.0, 0, 0], [0, 1, 0], [0.01, 0, -1]], dtype=torch.float64, requires_grad=True)
    point = torch.tensor([[100.0, 5.0]], dtype=torch.float64, requires_grad=True)
    mapped = apply_homography(horizon, point)
    mapped.sum().backward()
    assert mapped.abs().min() > 1e9
    assert mapped.isfinite().all()
    assert horizon.grad.isfinite().all()
    assert point.grad.isfinite().all()


def test_points_just_beyond_the_horizon_are_not_shielded():
    horizon = torch.tensor([[1.0, 0, 0], [0, 1, 0], [0.01, 0, -1]], dtype=torch.float64)
    near = torch.tensor([[100.0 + 1e-6, 5.0], [100.0 - 1e-6, 5.0]], dtype=torch.float64)
    torch.testing.assert_close(apply_homography(horizon, near), slow_transcription(horizon, near))


@pytest.mark.parametrize(("matrix", "points"), [((3, 4), (5, 2)), ((2, 3), (5, 2)), ((3, 3), (5, 3)), ((3, 3), (2,))])
def test_other_shapes_are_refused(matrix, points):
    with pytest.raises(ValueError, match="need H"):
        apply_homography(torch.zeros(matrix), torch.zeros(points))


@given(st.integers(1, 40), st.integers(1, 40), st.data())
def test_a_pixel_and_its_point_turn_to_the_same_place(height, width, data):
    y, x = data.draw(st.integers(0, height - 1)), data.draw(st.integers(0, width - 1))
    image = torch.zeros(3, height, width)
    image[:, y, x] = 1
    turned_x, turned_y = apply_homography(rotation_180((height, width)), torch.tensor([[x, y]]))[0].tolist()
    assert rotate_180(image)[:, int(turned_y), int(turned_x)].tolist() == [1, 1, 1]


def test_half_a_turn_by_hand():
    # x' = W - 1 - x, y' = H - 1 - y
    corner = apply_homography(rotation_180((400, 600)), torch.tensor([[0.0, 0.0], [599, 399], [10, 20]]))
    assert corner.tolist() == [[599, 399], [0, 0], [589, 379]]
    assert torch.equal(rotation_180((4, 6)) @ rotation_180((4, 6)), torch.eye(3, dtype=torch.float64))


def test_corner_error_by_hand():
    # 3 and 4 px off at every corner; the corners of 50 x 100 pixels are (0, 0), (99, 0), (99, 49), (0, 49).
    assert homography_corner_error_px(torch.tensor([[1.0, 0, 3], [0, 1, 4], [0, 0, 1]]), torch.eye(3), (50, 100)) == 5
    stretch = torch.diag(torch.tensor([1.1, 1, 1]))
    assert homography_corner_error_px(stretch, torch.eye(3), (50, 100)) == pytest.approx(9.9 / 2)


def test_corner_error_is_measured_in_b_whatever_the_scale_of_the_matrices():
    off = torch.tensor([[1.0, 0, 2], [0, 1, 0], [0, 0, 1]], dtype=torch.float64) @ H
    assert homography_corner_error_px(-3 * off, 0.1 * H, (400, 600)) == pytest.approx(2)
    assert homography_corner_error_px(H.float(), H, (400, 600)) < 1e-3


def test_corner_error_of_nothing_is_infinite():
    assert homography_corner_error_px(None, H, (400, 600)) == math.inf
