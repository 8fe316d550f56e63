"""The one door to maps: a file, a folder or a table, whatever says where its pictures lie."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import cast

from diffnav.data.coordinate_tables import TABLE_SUFFIXES
from diffnav.data.maps.coordinate_system import CoordinateSystem, told_of
from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.maps.geotiff import geotiff_map
from diffnav.data.maps.raster import RASTER_SUFFIXES, has_rasterio, map_pixels
from diffnav.data.maps.tables import is_map_table, table_maps
from diffnav.data.maps.world_files import world_file_map
from diffnav.data.photos import photo_of
from diffnav.errors import UserError
from diffnav.geometry.georeference import bounds_georeference, corners_georeference
from diffnav.images import IMAGE_SUFFIXES, find_images


def open_maps(
    path: str | Path,
    *,
    crs: str | None = None,
    origin: Sequence[float] | None = None,
    corners: Sequence[Sequence[float]] | None = None,
    bounds: Sequence[float] | None = None,
) -> list[GeoMap]:
    """The maps in an image file, a table of images, or a folder with either.

    A folder's maps are those of the one table in it, else every image below it. An image's place is told by the
    settings, by a GeoTIFF's tags, by a world file beside it, or by a table in its folder, in this order.

    Args:
        crs: the coordinate system in which the numbers of GeoTIFFs and world files count, over what they say
            themselves: `EPSG:...`, WKT, or `local` for metres around `origin` (latitude, longitude). For maps by
            corners or bounds: EPSG:3857 lays pixels evenly in Web-Mercator instead of degrees.
        corners: latitude, longitude of the outer corners top left, top right, bottom right, bottom left, of one image.
        bounds: north, west, south, east of the outer edge, of one image, in degrees.
    Returns: maps of different names, in the order of the table or of the file names.
    Raises: UserError, naming file or line, for a map that cannot be read, has no place or an impossible one.
    """
    path = Path(path).expanduser()
    if origin is not None and not _are_numbers(origin, 2):
        raise UserError(f"maps.origin must be [latitude,longitude] in degrees, got {origin}")
    system = CoordinateSystem(crs, None if origin is None else (origin[0], origin[1]))
    images, table = _contents(path)
    if corners is not None or bounds is not None:
        if table is not None or len(images) != 1:
            raise UserError(f"{path}: maps.corners and maps.bounds place one image; name the image or leave them out")
        return [_placed_map(images[0], system, corners, bounds)]
    if table is not None:
        return table_maps(table, system)
    root = path if path.is_dir() else path.parent
    stems = Counter(image.with_suffix("") for image in images)
    names = [photo_of(image, root, with_ending=stems[image.with_suffix("")] > 1).name for image in images]
    return [_image_map(image, name, system) for image, name in zip(images, names, strict=True)]


def _contents(path: Path) -> tuple[list[Path], Path | None]:
    """(the images, the table) that a path stands for: one of the two."""
    if path.is_dir():
        table = _table_in(path)
        return ([], table) if table else (find_images(path), None)
    if not path.exists():
        raise UserError(f"no map {path}: give an image, a folder of images or a table of them")
    if path.suffix.lower() in TABLE_SUFFIXES:
        return [], path
    if path.suffix.lower() not in IMAGE_SUFFIXES:
        kinds = " ".join(sorted(IMAGE_SUFFIXES | TABLE_SUFFIXES))
        raise UserError(f"{path}: no map; maps are files of the kinds {kinds}")
    return [path], None


def _table_in(folder: Path) -> Path | None:
    """The table of maps directly in a folder. Raises: UserError if there are two."""
    files = sorted(file for file in folder.iterdir() if file.suffix.lower() in TABLE_SUFFIXES and file.is_file())
    tables = [file for file in files if is_map_table(file)]
    if len(tables) > 1:
        raise UserError(f"{tables[0]} and {tables[1]} both list maps; name the one to use")
    return tables[0] if tables else None


def _image_map(path: Path, name: str, system: CoordinateSystem) -> GeoMap:
    """The map of an image that tells its place itself, or has it told beside it."""
    is_raster, readable = path.suffix.lower() in RASTER_SUFFIXES, has_rasterio()
    found = geotiff_map(path, name, system) if is_raster and readable else None
    found = found or world_file_map(path, name, system)
    if found is not None:
        return found
    table = _table_in(path.parent)
    listed = table_maps(table, system, only=path.name) if table else []
    if listed:
        return listed[0]
    if is_raster and not readable:
        raise UserError(f"{path}: a GeoTIFF needs rasterio: pip install 'diffnav[geo]'")
    # An unreadable picture is told before its missing place.
    map_pixels(path)
    raise UserError(
        f"{path}: nothing says where it lies; give maps.bounds=[north,west,south,east] or maps.corners, a world file "
        "(.jgw .pgw .tfw .wld) beside it, a GeoTIFF, or a table of maps (Filename,Top_left_lat,Top_left_lon,"
        "Bottom_right_lat,Bottom_right_long)"
    )


def _placed_map(
    path: Path,
    system: CoordinateSystem,
    corners: Sequence[Sequence[float]] | None,
    bounds: Sequence[float] | None,
) -> GeoMap:
    """The map of an image whose place the settings give."""
    if corners is not None and bounds is not None:
        raise UserError("maps.corners and maps.bounds both place the map; give one of them")
    pixels, plane = map_pixels(path), system.even_plane()
    if corners is not None:
        if len(corners) != 4 or not all(_are_numbers(corner, 2) for corner in corners):
            raise UserError(f"maps.corners must be four pairs [latitude,longitude], got {corners}")
        with told_of(f"maps.corners of {path}"):
            georeference = corners_georeference(pixels.size, corners, plane)
    else:
        if bounds is None or not _are_numbers(bounds, 4):
            raise UserError(f"maps.bounds must be [north,west,south,east] in degrees, got {bounds}")
        north, west, south, east = bounds
        with told_of(f"maps.bounds of {path}"):
            georeference = bounds_georeference(pixels.size, north, west, south, east, plane)
    return GeoMap(path.stem, georeference, pixels.read, pixels.fingerprint)


def _are_numbers(values: object, count: int) -> bool:
    numbers = isinstance(values, Sequence) and all(isinstance(value, int | float) for value in values)
    return numbers and len(cast(Sequence, values)) == count
