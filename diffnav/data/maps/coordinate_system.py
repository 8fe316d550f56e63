"""In which coordinate system a map's numbers count, and how its mistakes are told."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from diffnav.errors import UserError
from diffnav.geometry.georeference import AffineGeoreference, Degrees, ImpossibleBoundsError, Plane, plane_of
from diffnav.geometry.georeference.affine import Transform

_OVERRIDE = "set maps.crs=local maps.origin=[lat,lon] if its numbers are local metres, or maps.crs=EPSG:..."
# A pixel of 0.01 degrees is a kilometre wide: rather metres that nobody named.
_LARGEST_PIXEL_DEG = 0.01


@dataclass(frozen=True)
class CoordinateSystem:
    """What the user says of the numbers of a map: maps.crs and, for `local` metres, maps.origin; None: the map says it.

    Raises: UserError if the two do not go together.
    """

    crs: str | None = None
    origin: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        local = self.crs is not None and self.crs.strip().lower() == "local"
        if local and self.origin is None:
            raise UserError("maps.crs=local needs maps.origin=[latitude,longitude], the place where x and y are 0")
        if self.origin is not None and not local:
            raise UserError("maps.origin stands for maps in local metres: set maps.crs=local with it, or leave it out")
        if self.origin is not None and not is_place(self.origin):
            raise UserError(f"maps.origin must be [latitude,longitude] in degrees, got {list(self.origin)}")

    def plane(self, near: tuple[float, float]) -> Plane:
        """In which a map's x, y count, `near` being some of them; degrees where the user says nothing.

        Raises: UserError for a system that cannot be used.
        """
        try:
            return plane_of(self.crs, near, self.origin)
        except ValueError as error:
            raise UserError(f"maps.crs={self.crs}: {error}; give what pyproj understands, such as EPSG:25832") from None

    def even_plane(self) -> Plane:
        """In which pixels lie evenly between corners of known latitude and longitude: degrees or Web-Mercator.

        Raises: UserError for another system.
        """
        plane = (
            plane_of(self.crs) if self.crs is None or self.crs.strip().upper() in ("EPSG:4326", "EPSG:3857") else None
        )
        if plane is None:
            raise UserError(
                f"maps.crs={self.crs}: a map by its corners is even in EPSG:4326 or EPSG:3857; take one of them or none"
            )
        return plane


def affine_map(
    path: Path, size: tuple[int, int], transform: Transform, system: CoordinateSystem, stated: str | None
) -> AffineGeoreference:
    """The georeference of a map by six numbers (of pixel centres).

    Args: system: what the user says, which goes first; stated: the map's own coordinate system.
    Raises: UserError that names the file if neither is known or the two make no map.
    """
    near = (transform[2], transform[5])
    with told_of(path, _OVERRIDE):
        plane = system.plane(near) if system.crs is not None else plane_of(stated, near)
        return AffineGeoreference(size, plane, transform)


def stated_beside(path: Path) -> str | None:
    """The coordinate system in the .prj file beside a picture, None without one."""
    for suffix in (".prj", ".PRJ"):
        file = path.with_suffix(suffix)
        if file.is_file():
            return file.read_text(encoding="utf-8", errors="replace").strip() or None
    return None


def looks_like_degrees(size: tuple[int, int], transform: Transform) -> bool:
    """Whether six numbers can be degrees of an aerial map: on the earth, with pixels under a kilometre."""
    try:
        AffineGeoreference(size, Degrees(), transform)
    except ValueError:
        return False
    return bool(np.abs(np.array(transform)[[0, 1, 3, 4]]).max() <= _LARGEST_PIXEL_DEG)


@contextmanager
def told_of(path: Path | str, override: str = "") -> Iterator[None]:
    """Turns a georeference's ValueError into a sentence that names the file, with `override` for impossible bounds."""
    try:
        yield
    except ImpossibleBoundsError as error:
        raise UserError(f"{path}: {error}" + (f"; {override}" if override else "")) from None
    except ValueError as error:
        raise UserError(f"{path}: {error}") from None


def is_place(numbers: Sequence[float]) -> bool:
    """Whether these are a latitude and a longitude."""
    finite = len(numbers) == 2 and all(isinstance(number, int | float) for number in numbers)
    return finite and bool(np.isfinite(numbers).all()) and abs(numbers[0]) <= 90 and abs(numbers[1]) <= 360
