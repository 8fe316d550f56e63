"""Rectangles in perspective: which pixels they cover, against their corners projected by hand."""

import cv2
import numpy as np
import pytest

from diffnav.data.driving.street.camera import StreetCamera
from diffnav.data.driving.street.canvas import Box, Canvas

SIZE, FOCAL_PX, POSITION = (90, 160), 120.0, (0.5, -1.6, 3.0)


@pytest.fixture
def canvas() -> Canvas:
    return Canvas(StreetCamera(POSITION, FOCAL_PX, SIZE))


def plain(level: float):
    return lambda u, *_: (np.full((3, u.size), level, np.float32), np.ones(u.size, np.float32))


def by_hand(x: float, y: float, z: float) -> tuple[float, float]:
    away = z - POSITION[2]
    return 79.5 + FOCAL_PX * (x - POSITION[0]) / away, 44.5 + FOCAL_PX * (y - POSITION[1]) / away


def distances_px(corners: list[tuple[float, float]]) -> np.ndarray:
    """(h, w) signed distance of each pixel's centre to a polygon, positive inside."""
    polygon = np.array(corners, np.float32)
    return np.array(
        [[cv2.pointPolygonTest(polygon, (float(x), float(y)), True) for x in range(SIZE[1])] for y in range(SIZE[0])]
    )


def test_a_rectangle_that_faces_the_camera(canvas: Canvas) -> None:
    canvas.facing(9.0, Box(-1.0, 1.5, -2.0, -0.5), plain(0.8))
    corners = [by_hand(x, y, 9.0) for x, y in ((-1.0, -2.0), (1.5, -2.0), (1.5, -0.5), (-1.0, -0.5))]
    inside = distances_px(corners)
    assert np.allclose(canvas.colour[:, inside > 0.75], 0.8, atol=1e-5)
    assert np.all(canvas.colour[:, inside < -0.75] == 0)
    # Box-filtered edges keep the area: 2.5 m x 1.5 m at 20 px a metre.
    assert canvas.colour[0].sum() / 0.8 == pytest.approx(50 * 30, rel=0.002)
    assert np.all(canvas.depth[inside > 0.75] == 6.0)


@pytest.mark.parametrize("x", [-2.0, 2.5])
def test_a_rectangle_along_the_street(x: float, canvas: Canvas) -> None:
    canvas.beside(x, Box(8.0, 20.0, -2.5, 0.0), plain(0.8))
    corners = [by_hand(x, y, z) for y, z in ((-2.5, 8.0), (-2.5, 20.0), (0.0, 20.0), (0.0, 8.0))]
    inside = distances_px(corners)
    assert np.allclose(canvas.colour[:, inside > 1.5], 0.8, atol=1e-5)
    assert np.all(canvas.colour[:, inside < -1] == 0)
    columns = np.flatnonzero((inside > 1.5).any(0))
    for column in columns:
        # The plane x = constant meets a column at one depth.
        depth = FOCAL_PX * (x - POSITION[0]) / (column - 79.5)
        assert np.allclose(canvas.depth[inside[:, column] > 1.5, column], depth, rtol=1e-5)


def test_what_is_nearer_stays_in_front(canvas: Canvas) -> None:
    canvas.facing(9.0, Box(-1, 1, -2, -1), plain(0.8))
    canvas.facing(12.0, Box(-3, 3, -3, 0), plain(0.3))
    row, column = (round(p) for p in by_hand(0.0, -1.5, 9.0)[::-1])
    assert canvas.colour[0, row, column] == pytest.approx(0.8)
    canvas.facing(6.0, Box(-3, 3, -3, 0), plain(0.1))
    assert canvas.colour[0, row, column] == pytest.approx(0.1)


def test_nothing_is_seen_behind_the_camera(canvas: Canvas) -> None:
    canvas.facing(3.2, Box(-9, 9, -9, 9), plain(1.0))
    canvas.facing(1.0, Box(-9, 9, -9, 9), plain(1.0))
    canvas.beside(2.0, Box(-9.0, 2.0, -9, 9), plain(1.0))
    canvas.beside(POSITION[0], Box(0.0, 90.0, -9, 9), plain(1.0))
    assert not canvas.colour.any()
