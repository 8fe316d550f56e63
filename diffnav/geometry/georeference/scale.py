"""How large the pixels of a map are on the ground and how they are turned."""

import numpy as np
from numpy.typing import ArrayLike

from diffnav.geometry.geodesy import Array, offset_m
from diffnav.geometry.georeference.planar import Georeference


def metres_per_pixel(georeference: Georeference, points: ArrayLike) -> Array:
    """The map's scale at pixels (..., 2): (..., 2, 2), rows east and north in metres, columns a pixel of x and of y."""
    points = np.asarray(points, np.float64)
    columns = []
    for step in np.eye(2) / 2:
        before, after = georeference.latlon(points - step), georeference.latlon(points + step)
        columns.append(offset_m(before, after))
    return np.stack(columns, -1)


def ground_sample_distance_m(georeference: Georeference, points: ArrayLike | None = None) -> Array:
    """Metres a pixel at pixels (..., 2), the geometric mean over directions: (...); at the map's centre for None."""
    if points is None:
        height, width = georeference.size
        points = [(width - 1) / 2, (height - 1) / 2]
    return np.sqrt(np.abs(np.linalg.det(metres_per_pixel(georeference, points))))
