"""Where the pixels of a map lie on the earth: one file per way in which that is described."""

from diffnav.geometry.georeference.affine import AffineGeoreference, from_outer_corner
from diffnav.geometry.georeference.corners import CornerGeoreference, bounds_georeference, corners_georeference
from diffnav.geometry.georeference.part import cropped, scaled
from diffnav.geometry.georeference.planar import Georeference
from diffnav.geometry.georeference.planes import Degrees, LocalMetres, Plane, WebMercator
from diffnav.geometry.georeference.projected import Projected, plane_of
from diffnav.geometry.georeference.scale import ground_sample_distance_m, metres_per_pixel
from diffnav.geometry.georeference.soundness import ImpossibleBoundsError

__all__ = [
    "AffineGeoreference",
    "CornerGeoreference",
    "Degrees",
    "Georeference",
    "ImpossibleBoundsError",
    "LocalMetres",
    "Plane",
    "Projected",
    "WebMercator",
    "bounds_georeference",
    "corners_georeference",
    "cropped",
    "from_outer_corner",
    "ground_sample_distance_m",
    "metres_per_pixel",
    "plane_of",
    "scaled",
]
