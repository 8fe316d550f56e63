"""Photographs and where they lie: one flat description that every data set is brought to."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from torch import Tensor

from diffnav.darkness import Darkening
from diffnav.images import find_images, read_image

_TRAILING_NUMBER = re.compile(r"[_\-. ]*\d+$")


@dataclass(frozen=True)
class Photo:
    """One daylight picture, perhaps with its real or stored dark counterpart.

    name: path below the root, without ending, unique. site: the place or flight it comes from (splits keep sites
    together). normal: file or function of the daylight picture; None for a dark photo without one. low: file of
    the dark picture; None where darkness is made by Eq. 9. record: the stored darkening of `low`, if known.
    """

    name: str
    site: str
    normal: Path | Callable[[], Tensor] | None
    low: Path | None = None
    record: Darkening | None = None

    def read_normal(self) -> Tensor:
        """The daylight picture, (3, H, W) in [0, 1]. Raises: ImageError."""
        if self.normal is None:
            raise ValueError(f"{self.name} has no daylight picture")
        return read_image(self.normal) if isinstance(self.normal, Path) else self.normal()

    def read_low(self) -> Tensor:
        """The stored dark picture, (3, H, W) in [0, 1]. Raises: ImageError."""
        if self.low is None:
            raise ValueError(f"{self.name} has no stored dark picture")
        return read_image(self.low)


def folder_photos(root: str | Path) -> list[Photo]:
    """Every image below a folder; the site is the sub-folder, or the file name without its number.

    Raises: UserError if the folder is missing or holds no image.
    """
    root = Path(root).expanduser()
    return [photo_of(path, root) for path in find_images(root)]


def photo_of(path: Path, root: Path, site: str | None = None) -> Photo:
    """The photo in a file below `root`."""
    relative = path.relative_to(root)
    if site is None:
        inside_folder = relative.parent != Path(".")
        site = relative.parent.as_posix() if inside_folder else _TRAILING_NUMBER.sub("", path.stem)
    return Photo(name=relative.with_suffix("").as_posix(), site=site or path.stem, normal=path)
