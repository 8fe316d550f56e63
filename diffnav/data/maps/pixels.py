"""The pixels of a map's picture, window by window: decoded whole when first asked for, two pictures kept."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from PIL import Image
from torch import Tensor

from diffnav.data.maps.geo_map import Window
from diffnav.decoding import MAX_PIXELS, ORIENTATION_TAG
from diffnav.images import ImageError, from_uint8, read_image, to_uint8


@dataclass(frozen=True)
class MapPixels:
    """A map's picture without its place: size (h, w); read and fingerprint as in `GeoMap`."""

    size: tuple[int, int]
    read: Callable[[Window], Tensor]
    fingerprint: str


def picture_pixels(path: Path) -> MapPixels:
    """The pixels of any image file that `read_image` reads, upright; kept in 8 bit.

    Raises: ImageError if it is no image; what is damaged further on is found when it is read.
    """
    size, fingerprint = image_size(path), file_fingerprint(path)
    return MapPixels(size, partial(_read_window, path, size, fingerprint), fingerprint)


def image_size(path: Path) -> tuple[int, int]:
    """(h, w) of the upright picture as `read_image` gives it, from the file's header alone. Raises: ImageError."""
    Image.MAX_IMAGE_PIXELS = MAX_PIXELS
    try:
        with Image.open(path) as picture:
            width, height = picture.size
            on_its_side = picture.getexif().get(ORIENTATION_TAG, 1) in (5, 6, 7, 8)
            # Of a TIFF some releases of Pillow give the upright size, others the stored one.
            if not (on_its_side and picture.format == "TIFF"):
                return (width, height) if on_its_side else (height, width)
    except Exception:  # as many kinds as formats; reading the picture whole says in one sentence what is wrong
        pass
    image = read_image(path)
    return image.shape[1], image.shape[2]


def file_fingerprint(path: Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal. Raises: ImageError if it cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise ImageError(f"{path}: cannot be read ({error.strerror})") from None


def require_inside(window: Window, size: tuple[int, int]) -> None:
    """Raises ValueError unless the window (top, left, height, width) lies inside a map of `size` (h, w)."""
    top, left, height, width = window
    if top < 0 or left < 0 or height < 1 or width < 1 or top + height > size[0] or left + width > size[1]:
        raise ValueError(f"window {window} (top, left, height, width) leaves its map of height, width {size}")


def _read_window(path: Path, size: tuple[int, int], fingerprint: str, window: Window) -> Tensor:
    require_inside(window, size)
    levels = _decoded(path, fingerprint)
    if levels.shape[:2] != size:
        raise ImageError(f"{path}: has changed since it was opened; start again")
    top, left, height, width = window
    return from_uint8(levels[top : top + height, left : left + width])


# Two: neighbouring tiles are read in turn. The fingerprint tells a file that was written anew.
@lru_cache(maxsize=2)
def _decoded(path: Path, fingerprint: str) -> np.ndarray:  # noqa: ARG001
    return to_uint8(read_image(path))
