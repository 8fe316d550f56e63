"""The pixels of map files; those of TIFFs window by window from the file, by rasterio (extra `geo`)."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from diffnav.data.maps.geo_map import Window
from diffnav.data.maps.pixels import MapPixels, file_fingerprint, picture_pixels, require_inside
from diffnav.errors import UserError
from diffnav.images import ImageError

RASTER_SUFFIXES = frozenset({".tif", ".tiff"})


def has_rasterio() -> bool:
    """Whether rasterio can be imported."""
    try:
        import rasterio  # noqa: F401
    except ImportError:
        return False
    return True


def map_pixels(path: Path) -> MapPixels:
    """The pixels of any map file: a TIFF's are read when asked for where rasterio is there. Raises: ImageError."""
    windowed = path.suffix.lower() in RASTER_SUFFIXES and has_rasterio()
    return raster_pixels(path) if windowed else picture_pixels(path)


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """rasterio's dataset of a file. Raises: ImageError if it cannot be read; UserError without rasterio."""
    try:
        import rasterio
        from rasterio.errors import NotGeoreferencedWarning, RasterioError
    except ImportError:
        raise UserError(f"{path}: a GeoTIFF needs rasterio: pip install 'diffnav[geo]'") from None
    if not path.is_file():
        raise ImageError(f"{path}: no such file")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            with rasterio.open(path) as source:
                yield source
    except RasterioError as error:
        reason = " ".join(str(error).replace(str(path), "").split()).strip(" :'")
        raise ImageError(f"{path}: damaged image ({reason or 'reading failed'}); replace it") from None


def raster_pixels(path: Path) -> MapPixels:
    """The pixels of a TIFF, read when asked for; a single band is grey, nodata and transparency are black.

    8 and 16 bit are scaled by the largest value of their bits (the file's NBITS, if it states some), floating-point
    values must lie in [0, 1]; of more than three bands the red, green, blue ones are taken, else the first three.
    Raises: ImageError for a file or kind of values that cannot be read; UserError without rasterio.
    """
    with opened(path) as source:
        size = (source.height, source.width)
        _largest(source, path)
    return MapPixels(size, partial(_read_window, path, size), file_fingerprint(path))


def _read_window(path: Path, size: tuple[int, int], window: Window) -> Tensor:
    require_inside(window, size)
    top, left, height, width = window
    # rasterio's windows count columns first.
    place = ((top, top + height), (left, left + width))
    with opened(path) as source:
        if (source.height, source.width) != size:
            raise ImageError(f"{path}: has changed since it was opened; start again")
        bands = _colour_bands(source)
        values = source.read(bands, window=place)
        mask = source.dataset_mask(window=place).astype(np.float32) / 255
        largest = _largest(source, path)
        if source.colorinterp[0].name == "palette":
            values, largest = _coloured(values[0], source.colormap(1)), 255.0
    scaled = np.where(mask > 0, values.astype(np.float32) / largest, 0)
    if not (np.isfinite(scaled).all() and scaled.min() >= 0 and scaled.max() <= 1):
        raise ImageError(f"{path}: values outside of 0 to {largest:g}; save it with 8 or 16 bit")
    return torch.from_numpy(scaled * mask).expand(3, -1, -1).contiguous()


def _colour_bands(source: Any) -> list[int]:
    """The bands to read, counted from 1: three, or one that is grey or holds the numbers of a palette's colours."""
    kinds = [kind.name for kind in source.colorinterp]
    if {"red", "green", "blue"} <= set(kinds):
        return [kinds.index(colour) + 1 for colour in ("red", "green", "blue")]
    colours = [number for number, kind in enumerate(kinds, 1) if kind != "alpha"]
    return colours[:3] if len(colours) >= 3 else colours[:1]


def _coloured(numbers: np.ndarray, palette: Mapping[int, Sequence[int]]) -> np.ndarray:
    """(3, h, w) uint8 of a palette's numbers (h, w)."""
    colours = np.zeros((np.iinfo(numbers.dtype).max + 1, 3), np.uint8)
    for number, colour in palette.items():
        colours[number] = colour[:3]
    return colours[numbers].transpose(2, 0, 1)


def _largest(source: Any, path: Path) -> float:
    """The value that stands for 1."""
    kind = source.dtypes[_colour_bands(source)[0] - 1]
    if kind in ("uint8", "uint16", "int16"):
        bits = source.tags(_colour_bands(source)[0], ns="IMAGE_STRUCTURE").get("NBITS")
        return float(2 ** int(bits) - 1 if bits else np.iinfo(kind).max)
    if kind in ("float32", "float64"):
        return 1.0
    raise ImageError(f"{path}: holds values of kind {kind}; save it with 8 or 16 bit")
