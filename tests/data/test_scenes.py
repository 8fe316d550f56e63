"""The embedded world: repeatable, endless, consistent between windows, exact in its homographies, natural."""

import cv2
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from diffnav.data.scenes import SceneWindows, World, homography_pair, window_homography
from diffnav.errors import UserError

PLACE = (130.0, -240.0)


def grey8(image: Tensor) -> np.ndarray:
    """(h, w) uint8."""
    return (image.mean(0) * 255).round().byte().numpy()


def psnr(a: Tensor, b: Tensor) -> float:
    return float(-10 * torch.log10(((a - b) ** 2).mean()))


def transfer(H: Tensor, points: np.ndarray) -> np.ndarray:
    """(N, 2) points through H."""
    return cv2.perspectiveTransform(points.reshape(-1, 1, 2).astype(np.float64), H.numpy()).reshape(-1, 2)


def sift_errors_px(image_a: Tensor, image_b: Tensor, H_a_b: Tensor) -> np.ndarray:
    """(M, 2) x, y errors of the SIFT matches that pass the ratio test, in pixels of b."""
    # Without the precise upscaling OpenCV's SIFT puts every keypoint a quarter of a pixel off.
    sift = cv2.SIFT_create(enable_precise_upscale=True)
    keypoints_a, descriptors_a = sift.detectAndCompute(grey8(image_a), None)
    keypoints_b, descriptors_b = sift.detectAndCompute(grey8(image_b), None)
    pairs = cv2.BFMatcher().knnMatch(descriptors_a, descriptors_b, k=2)
    matches = [m for m, n in pairs if m.distance < 0.75 * n.distance]
    points_a = np.array([keypoints_a[m.queryIdx].pt for m in matches])
    points_b = np.array([keypoints_b[m.trainIdx].pt for m in matches])
    return points_b - transfer(H_a_b, points_a)


def spectrum_slope(image: Tensor) -> float:
    """Exponent of the radial amplitude spectrum, from 4 cycles per window to 0.4 cycles per pixel."""
    grey = image.mean(0).numpy()
    n = min(grey.shape)
    grey = (grey[:n, :n] - grey[:n, :n].mean()) * np.outer(np.hanning(n), np.hanning(n))
    power = np.abs(np.fft.fftshift(np.fft.fft2(grey))) ** 2
    rows, columns = np.indices(power.shape) - n // 2
    radius = np.hypot(rows, columns).astype(int).ravel()
    radial = np.sqrt(np.bincount(radius, power.ravel()) / np.bincount(radius))
    frequencies = np.arange(4, int(0.4 * n))
    return float(np.polyfit(np.log(frequencies), np.log(radial[frequencies]), 1)[0])


def test_the_same_seed_gives_the_same_world_and_another_seed_another():
    first, again, other = (World(seed).render(PLACE, size=(60, 90)) for seed in (3, 3, 4))
    assert torch.equal(first, again)
    assert (first - other).abs().mean() > 0.03
    assert first.dtype == torch.float32
    assert first.shape == (3, 60, 90)


def test_large_and_negative_seeds_are_worlds_of_their_own():
    images = [World(seed).render(PLACE, size=(20, 30)) for seed in (1, 1 + 2**32, -1, -2)]
    for k, image in enumerate(images):
        assert all((image - other).abs().mean() > 0.02 for other in images[:k])


def test_the_world_does_not_change_from_version_to_version():
    # Values of the first release; another value means that every stored map, query and result changes.
    centres = [(0.0, 0.0), (312.5, -87.25), (-4021.0, 1533.0)]
    colours = [World(7).render(centre, size=(1, 1)).flatten().tolist() for centre in centres]
    golden = [[0.6113, 0.6116, 0.6488], [0.4293, 0.4803, 0.3581], [0.3491, 0.3481, 0.2833]]
    np.testing.assert_allclose(colours, golden, atol=2e-3)


def test_a_part_of_a_window_equals_the_window_of_the_part():
    whole = World(1).render(PLACE, 0.25, 30.0, (301, 401))
    H = window_homography(PLACE, 0.25, 30.0, (301, 401))
    shift = torch.tensor([[1.0, 0, 90], [0, 1.0, 200], [0, 0, 1]], dtype=torch.float64)
    part = World(1).render_homography(H @ shift, (80, 150))
    difference = (part - whole[:, 200:280, 90:240]).abs()
    # Rounding may move a point across the edge of a shape.
    assert difference.flatten().quantile(0.999) < 1e-3


def test_turned_windows_show_the_same_colours_at_the_same_places():
    size = (201, 201)
    a, b = (World(2).render(PLACE, 0.2, heading, size) for heading in (0.0, 90.0))
    assert psnr(torch.rot90(a, 1, (1, 2)), b) > 45
    assert psnr(a, b) < 25


def test_the_image_runs_east_and_south():
    H = window_homography((10.0, 20.0), 0.5, 0.0, (5, 9))
    np.testing.assert_allclose(transfer(H, np.array([[4, 2], [5, 2], [4, 3]])), [[10, 20], [10.5, 20], [10, 19.5]])
    up = transfer(window_homography((0.0, 0.0), 1.0, 90.0, (3, 3)), np.array([[1, 0]]))
    np.testing.assert_allclose(up, [[1, 0]], atol=1e-12)


def test_sift_matches_land_on_the_exact_homography():
    size = (400, 600)
    views = [(PLACE, 0.2, 0.0), ((PLACE[0] + 6, PLACE[1] - 4), 0.26, 37.0)]
    H_a_world, H_b_world = (window_homography(*view, size) for view in views)
    image_a, image_b = (World(1).render(*view, size) for view in views)
    errors = sift_errors_px(image_a, image_b, torch.linalg.inv(H_b_world) @ H_a_world)
    correct = np.linalg.norm(errors, axis=1) <= 3
    assert correct.sum() >= 100
    # A pixel centre convention mixed up would show as half a pixel of bias.
    assert np.abs(np.median(errors[correct], axis=0)).max() < 0.1


def test_drawn_pairs_are_exact_under_perspective():
    pair = homography_pair(World(5), torch.Generator().manual_seed(2), (240, 320), (0.2, 0.2), perspective=0.25)
    again = homography_pair(World(5), torch.Generator().manual_seed(2), (240, 320), (0.2, 0.2), perspective=0.25)
    assert torch.equal(pair.image_b, again.image_b)
    assert abs(float(pair.H_a_b[2, 0])) > 1e-6
    H = torch.linalg.inv(pair.H_b_world) @ pair.H_a_world
    torch.testing.assert_close(pair.H_a_b, H / H[2, 2], rtol=1e-6, atol=1e-6)
    warped = cv2.warpPerspective(grey8(pair.image_a), pair.H_a_b.numpy(), (320, 240), flags=cv2.INTER_CUBIC)
    seen = cv2.warpPerspective(np.ones((240, 320), np.uint8), pair.H_a_b.numpy(), (320, 240)) > 0
    assert seen.mean() > 0.2
    assert np.abs(warped[seen] - grey8(pair.image_b)[seen].astype(float)).mean() < 8
    errors = sift_errors_px(pair.image_a, pair.image_b, pair.H_a_b)
    assert (np.linalg.norm(errors, axis=1) <= 3).sum() >= 50


@pytest.mark.parametrize("fine_m", [0.2, 0.5, 1.0])
def test_coarse_windows_are_the_fine_ones_averaged(fine_m):
    fine = World(1).render(PLACE, fine_m, 0.0, (240, 320))
    coarse = World(1).render(PLACE, 2 * fine_m, 0.0, (120, 160))
    assert psnr(torch.nn.functional.avg_pool2d(fine[None], 2)[0], coarse) >= 25


def test_windows_are_rich_bright_and_natural():
    windows = SceneWindows(0, 8, ground_sample_distance_m=(0.2, 0.2))
    counts, slopes, means = [], [], []
    for _, image in windows:
        assert image.min() >= 0
        assert 0.85 <= image.max() <= 1
        counts.append(len(cv2.SIFT_create().detect(grey8(image))))
        slopes.append(spectrum_slope(image))
        means.append(float(image.mean()))
    assert min(counts) >= 500
    assert -1.6 < min(slopes) <= max(slopes) < -0.8
    assert 0.3 < np.median(means) < 0.55


def test_windows_are_named_repeatable_and_independent_of_their_number():
    few, many = SceneWindows(9, 2, (30, 40)), SceneWindows(9, 5, (30, 40))
    assert len(many) == 5
    assert few.windows == many.windows[:2]
    assert len({name for name, _ in many}) == 5
    assert few[1][1].shape == (3, 30, 40)
    assert len({window.world for window in SceneWindows(9, 5, world=World(1)).windows}) == 1


@pytest.mark.parametrize("centre", [(1e6, -1e6), (-1e6 - 0.5, 3.0), (0.0, 0.0), (-37.0, 2e7)])
def test_the_world_has_no_end(centre):
    image = World(1).render(centre, 0.2, 10.0, (200, 300))
    assert torch.isfinite(image).all()
    assert image.std() > 0.04
    assert len(cv2.SIFT_create().detect(grey8(image))) > 200


@settings(max_examples=15, deadline=None)
@given(h=st.integers(1, 9), w=st.integers(1, 9), metres=st.floats(0.01, 60), heading=st.floats(-720, 720))
def test_any_size_scale_and_heading_gives_colours(h, w, metres, heading):
    image = World(3).render((-5.0, 7.0), metres, heading, (h, w))
    assert image.shape == (3, h, w)
    assert ((image >= 0) & (image <= 1)).all()


@pytest.mark.parametrize("size", [(0, 5), (5, -1), (2.5, 3)])
def test_a_size_below_one_pixel_is_refused(size):
    with pytest.raises(UserError, match="size"):
        World().render(size=size)


@pytest.mark.parametrize("metres", [0.0, -0.2, float("nan"), float("inf")])
def test_a_nonsense_ground_sample_distance_is_refused(metres):
    with pytest.raises(UserError, match="ground_sample_distance_m"):
        World().render(ground_sample_distance_m=metres)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([[1, 2, 0], [2, 4, 0], [0, 0, 1]], "singular"),
        ([[1, 0, 0], [0, -1, 0], [-0.1, 0, 1]], "horizon"),
        ([[1, 0, 0], [0, 1, 0], [0, 0, 0]], "horizon"),
        ([[1, 0, float("nan")], [0, 1, 0], [0, 0, 1]], "finite"),
        ([[1, 0, 1e12], [0, 1, 0], [0, 0, 1]], "beyond"),
        ([[1, 0], [0, 1]], "3 x 3"),
    ],
)
def test_views_that_cannot_be_rendered_are_refused(rows, message):
    with pytest.raises(UserError, match=message):
        World().render_homography(np.array(rows, float), (20, 30))


def test_nonsense_pairs_and_counts_are_refused():
    generator = torch.Generator().manual_seed(0)
    with pytest.raises(UserError, match="perspective"):
        homography_pair(World(), generator, perspective=0.5)
    with pytest.raises(UserError, match="count"):
        SceneWindows(0, -1)
