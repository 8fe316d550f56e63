"""Maps with a world file beside the picture: six lines A, D, B, E, C, F of its affine transform (ESRI)."""

import math
from pathlib import Path

from diffnav.data.maps.coordinate_system import CoordinateSystem, affine_map, looks_like_degrees, stated_beside
from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.maps.raster import map_pixels
from diffnav.errors import UserError
from diffnav.geometry.georeference.affine import Transform


def world_file_of(path: Path) -> Path | None:
    """The world file beside a picture: .jgw or .jpgw for .jpg, .pgw for .png, .tfw for .tif, or .wld; None without."""
    kind = path.suffix[1:].lower()
    for ending in (f"{kind[:1]}{kind[-1:]}w", f"{kind}w", "wld"):
        for suffix in (f".{ending}", f".{ending.upper()}"):
            file = path.with_suffix(suffix)
            if file.is_file():
                return file
    return None


def world_file_map(path: Path, name: str, system: CoordinateSystem) -> GeoMap | None:
    """The map in a picture with a world file, None without one.

    Its coordinate system: the user's, else that of the .prj beside it, else degrees if the numbers can be degrees.
    Raises: UserError that names the file if the world file is damaged or its system is not known; ImageError.
    """
    file = world_file_of(path)
    if file is None:
        return None
    transform, pixels = read_world_file(file), map_pixels(path)
    stated = stated_beside(path)
    if system.crs is None and stated is None and not looks_like_degrees(pixels.size, transform):
        raise UserError(
            f"{file}: its numbers (first pixel at {transform[2]:g}, {transform[5]:g}) are no degrees of an aerial map "
            "and no .prj file beside it names their system; set maps.crs, such as maps.crs=EPSG:25832"
        )
    georeference = affine_map(path, pixels.size, transform, system, stated)
    return GeoMap(name, georeference, pixels.read, pixels.fingerprint)


def read_world_file(file: Path) -> Transform:
    """The transform (a, b, c, d, e, f) in a world file; its C, F are the centre of the first pixel, as ours.

    Raises: UserError unless it holds six numbers.
    """
    try:
        numbers = [float(word) for word in file.read_text(encoding="utf-8-sig", errors="replace").split()]
    except OSError as error:
        raise UserError(f"{file}: cannot be read ({error.strerror})") from None
    except ValueError:
        numbers = []
    if len(numbers) != 6 or not all(math.isfinite(number) for number in numbers):
        raise UserError(f"{file}: a world file is six lines with one number each (A, D, B, E, C, F); write it again")
    a, d, b, e, c, f = numbers
    return a, b, c, d, e, f
