"""Maps that are described wrongly, whatever their kind."""

import numpy as np
import pytest

from diffnav.geometry.georeference import AffineGeoreference, Degrees, ImpossibleBoundsError, LocalMetres, plane_of


@pytest.mark.parametrize(
    ("transform", "reason"),
    [
        ((1e-4, 0, 10, 0, 1e-4, 50), "mirrored, as if seen from below"),
        ((-1e-4, 0, 10, 0, -1e-4, 50), "mirrored"),
        # Rows that run north: columns must run east.
        ((0, -1e-4, 50, 1e-4, 0, 10), "mirrored"),
        ((0, 1e-4, 10, 1e-4, 0, 50), None),
        ((0, 1e-4, 10, -1e-4, 0, 50), "mirrored"),
        ((1e-4, 0, 10, 0, -1e-4, 89.5), r"latitude 89\.50, within 1 degree of a pole"),
        ((1e-2, 0, 10, 0, -1e-2, -88.5), r"latitude -89\.\d+, within 1 degree of a pole"),
        ((1, 0, -50, 0, -1, 91), "are no degrees"),
        ((1e-4, 0, 5e5, 0, -1e-4, 50), "are no degrees"),
    ],
)
def test_six_numbers_in_degrees(transform, reason):
    if reason is None:
        AffineGeoreference((100, 100), Degrees(), transform)
        return
    with pytest.raises(ValueError, match=reason):
        AffineGeoreference((100, 100), Degrees(), transform)


def test_more_than_once_around_the_earth():
    with pytest.raises(ImpossibleBoundsError, match=r"spans 361\.0 degrees"):
        AffineGeoreference((100, 361), Degrees(), (1, 0, -180, 0, -1, 50))


def test_without_pixels():
    for size in ((0, 10), (10, 0)):
        with pytest.raises(ValueError, match="must be 1 x 1 or more"):
            AffineGeoreference(size, Degrees(), (1, 0, 0, 0, -1, 0))


def test_around_a_pole_though_its_edges_are_far_from_it():
    with pytest.raises(ValueError, match="shows a pole"):
        AffineGeoreference((100, 100), LocalMetres((88.0, 0.0)), (8e4, 0, -4e6, 0, -8e4, 4e6))
    pytest.importorskip("pyproj")
    with pytest.raises(ValueError, match="shows a pole"):
        # Polar stereographic, the pole between two of the points that are looked at.
        AffineGeoreference((100, 100), plane_of("EPSG:3413"), (1e5, 0, -5.3e6, 0, -1e5, 4.4e6))


def test_numbers_of_another_coordinate_system():
    """Metres of a UTM zone in a system that has no place for them, and a map larger than its system."""
    pytest.importorskip("pyproj")
    with pytest.raises(ValueError, match="outside of what its coordinate system covers"):
        AffineGeoreference((100, 100), plane_of("EPSG:32632", (3e7, 6e6)), (1e3, 0, 3e7, 0, -1e3, 6e6))
    with pytest.raises(ValueError, match="beyond the area of its coordinate system"):
        # World Mercator over its own edge at 180 degrees.
        AffineGeoreference((100, 100), plane_of("EPSG:3395", (2e7, 0)), (1e3, 0, 2.001e7, 0, -1e3, 0))


def test_metres_whose_bounds_could_be_degrees_pass():
    """What cannot be told: 40 m around the origin read as degrees are a map of a continent."""
    georeference = AffineGeoreference((400, 400), Degrees(), (0.2, 0, -40, 0, -0.2, 40))
    assert np.isfinite(georeference.latlon([0, 0])).all()
