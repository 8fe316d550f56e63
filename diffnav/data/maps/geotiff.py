"""GeoTIFF maps in any coordinate system, by rasterio and pyproj (extra `geo`)."""

from pathlib import Path

from diffnav.data.maps.coordinate_system import CoordinateSystem, affine_map, looks_like_degrees, stated_beside
from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.maps.raster import opened, raster_pixels
from diffnav.data.maps.world_files import world_file_of
from diffnav.errors import UserError
from diffnav.geometry.georeference import from_outer_corner


def geotiff_map(path: Path, name: str, system: CoordinateSystem) -> GeoMap | None:
    """The map in a TIFF that holds its transform or has it in a world file, None without either.

    Its coordinate system: the user's, else its own, else that of the .prj beside it; degrees without a name only
    where a world file lies beside it. The pixels are read when asked for.
    Raises: ImageError if it cannot be read; UserError if its system is not known or makes its bounds impossible, or
        without rasterio.
    """
    with opened(path) as source:
        corner = source.transform
        stated = (
            source.crs.to_string() if source.crs and (source.crs.is_geographic or source.crs.is_projected) else None
        )
    if corner.is_identity:
        return None
    pixels = raster_pixels(path)
    # rasterio's has three further numbers, the last row of a homogeneous matrix.
    transform = from_outer_corner(corner[:6])
    stated = stated or stated_beside(path)
    degrees = world_file_of(path) is not None and looks_like_degrees(pixels.size, transform)
    if system.crs is None and stated is None and not degrees:
        raise UserError(
            f"{path}: states no coordinate system on the earth; name it, such as maps.crs=EPSG:25832, or "
            "maps.crs=local maps.origin=[lat,lon] for local metres"
        )
    georeference = affine_map(path, pixels.size, transform, system, stated)
    return GeoMap(name, georeference, pixels.read, pixels.fingerprint)
