"""Views through homographies: the matrix, what is seen, what lies beyond."""

import math

import pytest
import torch

from diffnav.geometry.homography import apply_homography
from diffnav.geometry.views import draw_view, inside, pixel_grid, shows_image, view_homography

SIZE = (40, 60)


def blobs(points, size=SIZE, sigma=1.5):
    """(3, h, w): a Gaussian blob at each point, one channel each."""
    y, x = torch.meshgrid(torch.arange(float(size[0])), torch.arange(float(size[1])), indexing="ij")
    return torch.stack([torch.exp(-((x - px) ** 2 + (y - py) ** 2) / (2 * sigma**2)) for px, py in points])


def centroid(channel):
    y, x = torch.meshgrid(*(torch.arange(float(side)) for side in channel.shape), indexing="ij")
    return [((axis * channel).sum() / channel.sum()).item() for axis in (x, y)]


def test_the_plain_view_is_the_image():
    torch.testing.assert_close(view_homography(SIZE, 0.0, 1.0), torch.eye(3, dtype=torch.float64))


def test_turn_zoom_and_shift_by_hand():
    # A view pixel 10 right of the middle (29.5, 19.5) lies, after a quarter turn and at 2 image pixels per view
    # pixel, 20 below the image's middle; then everything moves by (3, -4).
    H = view_homography(SIZE, math.pi / 2, 2.0, (3.0, -4.0))
    assert apply_homography(H, torch.tensor([[39.5, 19.5]]))[0].tolist() == pytest.approx([32.5, 35.5])
    assert apply_homography(H, torch.tensor([[29.5, 9.5]]))[0].tolist() == pytest.approx([52.5, 15.5])


def test_tilt_by_hand():
    # At the view's right edge, 30 right of the middle, the divisor is 1.2.
    H = view_homography(SIZE, 0.0, 1.0, tilt=(0.2, 0.0))
    assert apply_homography(H, torch.tensor([[59.5, 19.5]]))[0].tolist() == pytest.approx([29.5 + 30 / 1.2, 19.5])
    assert apply_homography(H, torch.tensor([[-0.5, 19.5]]))[0].tolist() == pytest.approx([29.5 - 30 / 0.8, 19.5])


def test_marked_points_are_seen_where_the_homography_says():
    marks = [(24.0, 14.0), (37.0, 24.0), (30.0, 20.0)]
    H = view_homography(SIZE, 0.7, 0.9, (1.0, -2.0), (0.1, -0.05))
    view = draw_view(blobs(marks), H, SIZE) * shows_image(H, SIZE, SIZE)
    for channel, mark in zip(view, marks, strict=True):
        found = apply_homography(H, torch.tensor([centroid(channel)]))[0].tolist()
        assert found == pytest.approx(mark, abs=0.1)


def test_a_ramp_is_sampled_exactly():
    """Bilinear samples and their mean change no plane: the view of x is the mapped x."""
    ramp = torch.arange(60.0).expand(3, 40, -1) / 60
    H = view_homography(SIZE, 0.3, 0.5)
    expected = apply_homography(H, pixel_grid(SIZE))[:, 0].reshape(SIZE) / 60
    torch.testing.assert_close(draw_view(ramp, H, SIZE)[0], expected.float(), atol=1e-5, rtol=0)


def test_shrinking_leaves_no_aliases():
    """Stripes of two pixels, seen at half the size, are grey."""
    stripes = (torch.arange(60) % 2).float().expand(3, 40, -1)
    view = draw_view(stripes, view_homography(SIZE, 0.0, 2.0), SIZE)
    assert (view[:, 12:28, 18:42] - 0.5).abs().max() < 1e-5


def test_beyond_its_edges_the_image_is_mirrored():
    ramp = torch.arange(8.0).expand(1, 6, -1) / 8
    move = torch.eye(3, dtype=torch.float64)
    move[0, 2] = 5
    row = draw_view(ramp, move, (6, 8))[0, 3] * 8
    # 5, 6, then the fold at 7, where the samples at 6.75 and 7.25 both see 6.75, and back again.
    assert row.tolist() == pytest.approx([5, 6, 6.75, 6, 5, 4, 3, 2], abs=1e-4)


def test_what_shows_the_image_against_a_slow_loop():
    H = view_homography(SIZE, 0.5, 1.4, (4.0, 1.0), (0.2, 0.1))
    shown = shows_image(H, SIZE, (30, 50))
    assert 0.2 < shown.float().mean() < 0.9
    for y in range(0, SIZE[0], 3):
        for x in range(0, SIZE[1], 3):
            u, v, w = (sum(a * b for a, b in zip(row, (x, y, 1.0), strict=True)) for row in H.tolist())
            assert shown[y, x].item() == (0 <= u / w <= 49 and 0 <= v / w <= 29)


def test_inside_includes_the_outermost_pixels():
    points = torch.tensor([[0.0, 0.0], [49.0, 29.0], [49.1, 5.0], [5.0, -0.1]])
    assert inside(points, (30, 50)).tolist() == [True, True, False, False]
