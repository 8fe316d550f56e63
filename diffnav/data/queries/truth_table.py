"""Tables of truth: which columns hold what, and which row belongs to which photo.

Recognised by their headers are wildnav's photo_metadata.csv (Filename,Latitude,Longitude,Altitude,Gimball_Roll,
Gimball_Yaw,...: the spelling is theirs), aerovloc's queries.txt (filename lon lat), UAV-VisLoc's flights
(num,filename,date,lat,lon,height,Omega,Kappa,Phi1,Phi2: written from the data set's published description, which
calls Phi1 the heading), and any with columns for name, latitude and longitude, in any order.
"""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

from diffnav.data.coordinate_tables import Table, read_table
from diffnav.data.queries.facts import Truth, parsed_time
from diffnav.errors import UserError
from diffnav.geometry.geodesy import wrapped_deg

# The first that is there counts: the camera's yaw before the craft's.
_NAMES = {
    "name": ("filename", "file", "name", "image", "imagename", "photo", "picture", "sourcefile"),
    "latitude": ("lat", "gpslat", "latdeg"),
    "longitude": ("lon", "gpslon", "lng", "gpslng", "londeg"),
    "height_m": ("heightm", "relativealtitude", "relativealtitudem", "height", "altitude", "alt"),
    "heading_deg": (
        "headingdeg", "heading", "gimballyaw", "gimbalyaw", "gimbalyawdegree", "cameraheading", "compassheading",
        "yaw", "yawdeg", "flightyaw", "flightyawdegree", "phi1",
    ),
    "time": ("time", "datetime", "timestamp", "datetimeoriginal", "datetaken", "date"),
}  # fmt: skip
# Of faulty lines; the rest is counted.
_LISTED = 3
_NEEDED = ("name", "latitude", "longitude")
Columns = Mapping[str, str | int]


def is_truth_table(path: Path) -> bool:
    """Whether the header of a text file has columns for name, latitude and longitude."""
    found = read_table(path, first_line_only=True).columns(_NAMES)
    return all(role in found for role in _NEEDED)


def table_truth(
    path: Path, photos: Mapping[str, Path], columns: Columns | None = None
) -> tuple[dict[str, Truth], list[str]]:
    """(the truth of those photos that a table names, problems as sentences).

    Args:
        photos: name -> file; a row names a file by its path below the table or by its name, whatever the ending.
        columns: which column holds what: name, latitude, longitude and where they exist height_m, heading_deg, time
            -> its header, or its number from 1 for tables without one; None recognises common headers.
    Raises: UserError if the file cannot be read, its columns are not known, header and first row are glued together,
        or latitude and longitude are exchanged.
    """
    table = read_table(path)
    rows, positions = _rows_and_positions(table, columns)
    index = _index(path.parent, photos)
    truths: dict[str, Truth] = {}
    problems: list[str] = []
    strangers: list[str] = []
    for line, cells in rows:
        values = {role: cells[place] if place < len(cells) else "" for role, place in positions.items()}
        where = f"{path} line {line}"
        named = _match(index, values["name"])
        if not named:
            strangers.append(values["name"])
            continue
        problem = _fault(where, values, named, named[0] in truths) or _misplaced(table, where, values)
        if problem:
            problems.append(problem)
        else:
            truths[named[0]] = _truth(table, values)
    if len(problems) > _LISTED:
        problems[_LISTED:] = [f"{path}: {len(problems) - _LISTED} more lines with such mistakes"]
    if strangers:
        count = f"{len(strangers)} pictures that are" if len(strangers) > 1 else "a picture that is"
        problems.append(f"{path}: names {count} not there ({strangers[0]})")
    return truths, problems


def _rows_and_positions(table: Table, columns: Columns | None) -> tuple[list[tuple[int, list[str]]], dict[str, int]]:
    if columns is None:
        positions = table.columns(_NAMES)
        if not all(role in positions for role in _NEEDED):
            raise UserError(
                f"{table.path}: cannot tell its columns ({', '.join(table.header[:8])}); say which they are, such as "
                "columns={name: file, latitude: lat, longitude: lon} or by their numbers from 1"
            )
        table.require_header_apart()
        return table.rows, positions
    positions = _stated_positions(table, columns)
    first = table.header[positions["latitude"]] if positions["latitude"] < len(table.header) else ""
    headless = table.number(first) is not None
    return ([(1, table.header), *table.rows] if headless else table.rows), positions


def _stated_positions(table: Table, columns: Columns) -> dict[str, int]:
    unknown = [role for role in columns if role not in _NAMES]
    lacking = [role for role in _NEEDED if role not in columns]
    if unknown or lacking:
        raise UserError(
            f"columns has {', '.join(columns)}; it needs name, latitude, longitude and may have "
            "height_m, heading_deg, time"
        )
    positions = {}
    for role, column in columns.items():
        if isinstance(column, int):
            positions[role] = column - 1
        elif column in table.header:
            positions[role] = table.header.index(column)
        else:
            raise UserError(
                f"{table.path}: has no column {column!r} (columns.{role}); it has {', '.join(table.header)}"
            )
        if positions[role] < 0:
            raise UserError(f"columns.{role} must be a number from 1 or a header, got {column}")
    return positions


def _fault(where: str, values: Mapping[str, str], named: list[str], again: bool) -> str | None:
    if len(named) > 1:
        return f"{where}: {values['name']} is {len(named)} files ({named[0]}, {named[1]}); write its folder too"
    return f"{where}: names {values['name']} again; its first line counts" if again else None


def _misplaced(table: Table, where: str, values: Mapping[str, str]) -> str | None:
    """Why a row's numbers are no place; None if they are one. Raises: UserError if they look exchanged."""
    latitude, longitude = (table.number(values[role]) for role in ("latitude", "longitude"))
    if latitude is None or longitude is None:
        return f"{where}: {values['latitude']!r}, {values['longitude']!r} are no latitude and longitude in degrees"
    if abs(latitude) > 90 and abs(longitude) <= 90:
        raise UserError(
            f"{where}: latitude {latitude:g} is beyond 90 degrees and longitude {longitude:g} is not: latitude and "
            "longitude look exchanged; say which is which with columns={name: ..., latitude: ..., longitude: ...}"
        )
    if abs(latitude) > 90 or abs(longitude) > 360:
        return f"{where}: {latitude:g}, {longitude:g} is no latitude and longitude in degrees"
    return None


def _truth(table: Table, values: Mapping[str, str]) -> Truth:
    numbers = {role: table.number(text) for role, text in values.items() if role not in ("name", "time")}
    heading, longitude = numbers.get("heading_deg"), numbers["longitude"]
    return Truth(
        latitude=numbers["latitude"],
        longitude=None if longitude is None else float(wrapped_deg(longitude)),
        height_m=numbers.get("height_m"),
        heading_deg=None if heading is None else heading % 360,
        time=parsed_time(values.get("time", "")),
    )


def _index(folder: Path, photos: Mapping[str, Path]) -> list[dict[str, list[str]]]:
    """Photo names by their files' path below the folder, by file name, and by file name without ending."""
    by_path: dict[str, list[str]] = defaultdict(list)
    by_name: dict[str, list[str]] = defaultdict(list)
    by_stem: dict[str, list[str]] = defaultdict(list)
    for name, file in photos.items():
        if file.is_relative_to(folder):
            by_path[file.relative_to(folder).as_posix().lower()].append(name)
        by_name[file.name.lower()].append(name)
        by_stem[file.stem.lower()].append(name)
    return [by_path, by_name, by_stem]


def _match(index: list[dict[str, list[str]]], written: str) -> list[str]:
    """The photos that a row means, all if it leaves it open: by path, else by file name, else whatever the ending."""
    by_path, by_name, by_stem = index
    path = written.replace("\\", "/").removeprefix("./").lower()
    name = path.rsplit("/", 1)[-1]
    return by_path.get(path) or by_name.get(name) or by_stem.get(name) or by_stem.get(Path(name).stem) or []
