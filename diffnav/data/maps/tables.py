"""Maps listed in a table with their bounds or corners: wildnav, UAV-VisLoc, aerovloc and the like.

Known headers, by any separator and spelling of case, blanks and underscores:
  wildnav     Filename, Top_left_lat,Top_left_lon,Bottom_right_lat,Bottom_right_long
  aerovloc    filename top_left_lat top_left_lon bottom_right_lat bottom_right_lon
  UAV-VisLoc  mapname,LT_lat_map,LT_lon_map,RB_lat_map,RB_lon_map,region
and four corners, with top_right and bottom_left, or north, west, south, east. UAV-VisLoc is written from the data
set's published description; its pictures lie in folders of their own below the table.
"""

from collections.abc import Mapping
from pathlib import Path

from diffnav.data.coordinate_tables import Table, read_table
from diffnav.data.maps.coordinate_system import CoordinateSystem, told_of
from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.maps.raster import map_pixels
from diffnav.errors import UserError
from diffnav.geometry.georeference import Georeference, bounds_georeference, corners_georeference

_NAME = ("filename", "mapname", "file", "name", "image", "imagename", "tile")
_EDGES = {
    "north": ("topleftlat", "ltlatmap", "ltlat", "tllat", "ullat", "north", "top", "maxlat"),
    "west": ("topleftlon", "ltlonmap", "ltlon", "tllon", "ullon", "west", "left", "minlon"),
    "south": ("bottomrightlat", "rblatmap", "rblat", "brlat", "lrlat", "south", "bottom", "minlat"),
    "east": ("bottomrightlon", "rblonmap", "rblon", "brlon", "lrlon", "east", "right", "maxlon"),
}
_OTHER_CORNERS = {
    "top_right_lat": ("toprightlat", "trlat", "rtlat", "urlat"),
    "top_right_lon": ("toprightlon", "trlon", "rtlon", "urlon"),
    "bottom_left_lat": ("bottomleftlat", "bllat", "lblat", "lllat"),
    "bottom_left_lon": ("bottomleftlon", "bllon", "lblon", "lllon"),
}


def is_map_table(path: Path) -> bool:
    """Whether the header of a text file is that of a table of maps, be it damaged at its end."""
    table = read_table(path, first_line_only=True)
    return table.column(_NAME) is not None and len(table.columns(_EDGES)) >= 3


def table_maps(path: Path, system: CoordinateSystem | None = None, only: str | None = None) -> list[GeoMap]:
    """The maps that a table lists, in its order; the numbers are those of the outer edge of the outer pixels.

    Args: system: in whose plane pixels lie evenly between the corners; the corners are latitude, longitude always.
        only: the one file name that is wanted.
    Raises: UserError, naming the line, for a damaged header, a row without its numbers, a picture that is missing or
        cannot be read, or one that is named twice.
    """
    table = read_table(path)
    columns = _columns(table)
    maps: dict[str, GeoMap] = {}
    for line, cells in table.rows:
        name = cells[columns["name"]] if columns["name"] < len(cells) else ""
        if only is not None and Path(name).name != only:
            continue
        file = _file(path, line, name)
        if name in maps:
            raise UserError(f"{path} line {line}: names {name} again; keep one of its lines")
        numbers = _numbers(table, line, cells, columns)
        pixels = map_pixels(file)
        with told_of(f"{path} line {line} ({name})"):
            georeference = _georeference(pixels.size, numbers, system or CoordinateSystem())
        maps[name] = GeoMap(name, georeference, pixels.read, pixels.fingerprint)
    if not maps and only is None:
        raise UserError(f"{path}: lists no map below its header")
    return _with_short_names(list(maps.values()))


def _columns(table: Table) -> dict[str, int]:
    table.require_header_apart()
    name, edges, others = table.column(_NAME), table.columns(_EDGES), table.columns(_OTHER_CORNERS)
    missing = [edge for edge in _EDGES if edge not in edges]
    if name is None or missing:
        lacking = ", ".join((["file name"] if name is None else []) + missing)
        raise UserError(
            f"{table.path}: is no table of maps, its header lacks {lacking}; "
            "write Filename,Top_left_lat,Top_left_lon,Bottom_right_lat,Bottom_right_long"
        )
    return {"name": name, **edges, **(others if len(others) == len(_OTHER_CORNERS) else {})}


def _numbers(table: Table, line: int, cells: list[str], columns: Mapping[str, int]) -> dict[str, float]:
    numbers = {}
    for role, column in columns.items():
        if role == "name":
            continue
        cell = cells[column] if column < len(cells) else ""
        number = table.number(cell)
        if number is None:
            raise UserError(
                f"{table.path} line {line}: {table.header[column]} is {cell!r}, no number; write it in degrees"
            )
        numbers[role] = number
    return numbers


def _georeference(size: tuple[int, int], numbers: Mapping[str, float], system: CoordinateSystem) -> Georeference:
    north, west, south, east = (numbers[edge] for edge in _EDGES)
    plane = system.even_plane()
    if "top_right_lat" not in numbers:
        return bounds_georeference(size, north, west, south, east, plane)
    top_right, bottom_left = (
        (numbers[f"{corner}_lat"], numbers[f"{corner}_lon"]) for corner in ("top_right", "bottom_left")
    )
    return corners_georeference(size, [(north, west), top_right, (south, east), bottom_left], plane)


def _file(path: Path, line: int, name: str) -> Path:
    """The picture that a row names: beside the table, else the only one of its name below."""
    if not name:
        raise UserError(f"{path} line {line}: names no picture; write its file name")
    beside = path.parent / name
    if beside.is_file():
        return beside
    below = [file for file in sorted(path.parent.rglob("*")) if file.name == Path(name).name and file.is_file()]
    if len(below) == 1:
        return below[0]
    if below:
        raise UserError(
            f"{path} line {line}: {name} is {len(below)} files ({below[0]}, {below[1]}); write its folder too"
        )
    raise UserError(f"{path} line {line}: no such file {beside}; put it there or take the line out")


def _with_short_names(maps: list[GeoMap]) -> list[GeoMap]:
    """The maps named without their files' endings, unless two would have one name."""
    short = [Path(item.name).with_suffix("").as_posix() for item in maps]
    if len(set(short)) < len(short):
        return maps
    return [
        GeoMap(name, item.georeference, item.read, item.fingerprint) for name, item in zip(short, maps, strict=True)
    ]
