"""Photographs and where they lie: one flat description that every data set is brought to."""

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from torch import Tensor

from diffnav.darkness import Darkening
from diffnav.images import ImageError, find_images, read_image

_TRAILING_NUMBER = re.compile(r"[_\-. ]*\d+$")


@dataclass(frozen=True)
class Photo:
    """One daylight picture, perhaps with its real or stored dark counterpart.

    name: path below the root, unique; without ending, unless files differ in it alone. site: the place or flight it
    comes from (splits keep sites together). normal: file or function of the daylight picture; None for a dark photo
    without one. low: file of the dark picture; None where darkness is made by Eq. 9. record: the stored darkening of
    `low`, if known.
    """

    name: str
    site: str
    normal: Path | Callable[[], Tensor] | None
    low: Path | None = None
    record: Darkening | None = None

    def read_normal(self) -> Tensor:
        """The daylight picture, (3, H, W) in [0, 1]. Raises: ImageError."""
        if self.normal is None:
            raise ImageError(f"{self.low or self.name}: has no daylight picture to compare it with; leave it out")
        return read_image(self.normal) if isinstance(self.normal, Path) else self.normal()

    def read_low(self) -> Tensor:
        """The stored dark picture, (3, H, W) in [0, 1]. Raises: ImageError."""
        if self.low is None:
            raise ImageError(f"{self.name}: has no stored dark picture")
        return read_image(self.low)


def folder_photos(root: str | Path) -> list[Photo]:
    """Every image below a folder; the site is the sub-folder, or the file name without its number.

    Raises: UserError if the folder is missing or holds no image.
    """
    root = Path(root).expanduser()
    paths = find_images(root)
    stems = Counter(path.with_suffix("") for path in paths)
    return [photo_of(path, root, with_ending=stems[path.with_suffix("")] > 1) for path in paths]


def photo_of(path: Path, root: Path, site: str | None = None, with_ending: bool = False) -> Photo:
    """The photo in a file below `root`."""
    relative = path.relative_to(root)
    if site is None:
        inside_folder = relative.parent != Path(".")
        site = relative.parent.as_posix() if inside_folder else _TRAILING_NUMBER.sub("", path.stem)
    name = relative if with_ending else relative.with_suffix("")
    return Photo(name=name.as_posix(), site=site or path.stem, normal=path)
