"""The picture while it is painted: colours and depths, and rectangles drawn into it in exact perspective."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from diffnav.data.driving.street.camera import Array, StreetCamera
from diffnav.data.scenery import shapes

# (u, v, footprint along u, footprint along v) of N points, metres -> colours (3, N) and coverages (N,) in [0, 1].
Paint = Callable[[Array, Array, Array, Array], tuple[Array, Array]]
NEAREST_M = 0.5


@dataclass(frozen=True)
class Box:
    """Limits of a rectangle on its plane, metres: from left to right along u, from top to bottom along v."""

    left: float
    right: float
    top: float
    bottom: float

    def cover(self, u: Array, v: Array, footprint_u: Array, footprint_v: Array) -> Array:
        """(N,) coverage of pixels about the points u, v (N,) by the rectangle."""
        across = shapes.stripe(u - (self.left + self.right) / 2, (self.right - self.left) / 2, footprint_u)
        return across * shapes.stripe(v - (self.top + self.bottom) / 2, (self.bottom - self.top) / 2, footprint_v)


class Canvas:
    """A camera's picture: colour (3, h, w) float32, depth (h, w) along z, metres, infinite where nothing is yet."""

    def __init__(self, camera: StreetCamera) -> None:
        self.camera = camera
        self.colour = np.zeros((3, *camera.size), np.float32)
        self.depth = np.full(camera.size, np.inf, np.float32)

    def paint(self, rows: Array, columns: Array, colour: Array, cover: Array, depth_m: Array) -> None:
        """Lay colours (3, N) of coverages (N,) over N pixels, whatever their depth was."""
        part = self.colour[:, rows, columns]
        self.colour[:, rows, columns] = shapes.blend(part, colour, cover)
        self.depth[rows, columns] = np.where(cover > 0.5, depth_m, self.depth[rows, columns])

    def facing(self, z: float, box: Box, paint: Paint) -> None:
        """Draw a rectangle that faces the camera, u is x and v is y; what is nearer stays in front of it."""
        x, y, z_camera = self.camera.position_m
        depth = z - z_camera
        if depth < NEAREST_M:
            return
        right, down = self.camera.rays()
        edge = depth / self.camera.focal_px
        columns = np.flatnonzero((x + right * depth > box.left - edge) & (x + right * depth < box.right + edge))
        rows = np.flatnonzero((y + down * depth > box.top - edge) & (y + down * depth < box.bottom + edge))
        i, j = (axis.ravel() for axis in np.meshgrid(rows, columns, indexing="ij"))
        points = x + right[j] * depth, y + down[i] * depth
        footprints = np.full(i.size, edge), np.full(i.size, edge)
        self._draw(i, j, points, np.full(i.size, depth), footprints, box, paint)

    def beside(self, x: float, box: Box, paint: Paint) -> None:
        """Draw a rectangle along the street, u is z and v is y; what is nearer stays in front of it."""
        x_camera, y, z = self.camera.position_m
        right, down = self.camera.rays()
        aside = x - x_camera
        # Rays that lead away from the plane, or along it, meet it nowhere before the camera.
        towards = np.flatnonzero(right * aside > 0)
        depths = aside / right[towards]
        seen = (depths > NEAREST_M) & (z + depths > box.left) & (z + depths < box.right)
        columns, depths = towards[seen], depths[seen]
        i, k = (axis.ravel() for axis in np.meshgrid(np.arange(len(down)), np.arange(columns.size), indexing="ij"))
        v = y + down[i] * depths[k]
        inside = np.flatnonzero((v > box.top) & (v < box.bottom))
        i, j, depth, v = i[inside], columns[k[inside]], depths[k[inside]], v[inside]
        footprints = (depth**2 / abs(aside) / self.camera.focal_px, depth / self.camera.focal_px)
        self._draw(i, j, (z + depth, v), depth, footprints, box, paint)

    def _draw(
        self,
        rows: Array,
        columns: Array,
        points: tuple[Array, Array],
        depth_m: Array,
        footprints_m: tuple[Array, Array],
        box: Box,
        paint: Paint,
    ) -> None:
        front = np.flatnonzero(depth_m < self.depth[rows, columns])
        if front.size == 0:
            return
        u, v = (point[front] for point in points)
        foot_u, foot_v = (foot[front].astype(np.float32) for foot in footprints_m)
        colour, cover = paint(u, v, foot_u, foot_v)
        self.paint(rows[front], columns[front], colour, cover * box.cover(u, v, foot_u, foot_v), depth_m[front])
