"""The pixels of an image file, whatever its kind: the decoding behind `images.read_image`."""

from pathlib import Path

import cv2
import numpy as np
import torch
from PIL import Image, ImageFile, UnidentifiedImageError
from torch import Tensor

from diffnav.errors import UserError

_WIDE_MODES = frozenset({"I", "I;16", "I;16L", "I;16B", "I;16N", "F"})
# Satellite maps pass Pillow's guard against decompression bombs (89 Mpx); this one still stops absurd sizes.
MAX_PIXELS = 1_000_000_000
ORIENTATION_TAG = 0x0112


class ImageError(UserError):
    """An image file that cannot be used; the sentence names it and says why."""


def decode(path: Path) -> tuple[Tensor, int]:
    """(image as it is stored, EXIF orientation still to be applied, 1 for none)."""
    Image.MAX_IMAGE_PIXELS = MAX_PIXELS
    ImageFile.LOAD_TRUNCATED_IMAGES = False
    try:
        with Image.open(path) as picture:
            raw_modes = str(picture.tile)
            # Pillow finds truncation, which OpenCV would pass over, and turns TIFFs upright.
            picture.load()
            try:
                orientation = int(picture.getexif().get(ORIENTATION_TAG, 1))
            except Exception:  # a damaged EXIF block does not make the picture unreadable
                orientation = 1
            # 16-bit colour would come out of Pillow cut to 8 bit.
            if picture.mode not in _WIDE_MODES and ";16" in raw_modes and picture.format in ("PNG", "TIFF"):
                return _decode_wide(path), orientation
            return _to_tensor(picture, path), orientation
    except UnidentifiedImageError:
        with path.open("rb") as file:
            if file.read(4) not in (b"II*\0", b"MM\0*"):
                raise
        # A TIFF of a kind that Pillow lacks: 16-bit colour in older releases, floating-point colour.
        return _decode_wide(path), 1


def _to_tensor(picture: Image.Image, path: Path) -> Tensor:
    if picture.mode in _WIDE_MODES:
        return torch.from_numpy(_scale(np.asarray(picture), path)).expand(3, -1, -1)
    if picture.mode in ("RGBA", "LA", "PA", "RGBa", "La") or "transparency" in picture.info:
        rgba = picture.convert("RGBA")
        black = Image.new("RGBA", rgba.size, (0, 0, 0, 255))
        picture = Image.alpha_composite(black, rgba)
    levels = torch.from_numpy(np.array(picture.convert("RGB")))
    return levels.permute(2, 0, 1).float().div_(255)


def _decode_wide(path: Path) -> Tensor:
    """Colour of more than 8 bit by OpenCV, which turns TIFFs upright and leaves PNGs as they are stored."""
    values = cv2.imdecode(np.fromfile(path, np.uint8), cv2.IMREAD_UNCHANGED)
    if values is None or values.ndim != 3 or values.shape[2] not in (3, 4):
        raise ImageError(f"{path}: not an image that can be read; save it as RGB with 8 or 16 bit")
    values = _scale(values, path)
    colour = values[..., 2::-1] * values[..., 3:] if values.shape[2] == 4 else values[..., ::-1]
    return torch.from_numpy(np.ascontiguousarray(colour)).permute(2, 0, 1)


def _scale(values: np.ndarray, path: Path) -> np.ndarray:
    """16-bit or floating-point values as float32 in [0, 1]. Raises: ImageError if they lie outside."""
    whole = np.issubdtype(values.dtype, np.integer)
    scaled = values.astype(np.float32) / (65535 if whole else 1)
    if not np.isfinite(scaled).all():
        raise ImageError(f"{path}: holds NaN or infinite values; save it with values from 0 to 1")
    if scaled.min() < 0 or scaled.max() > 1:
        raise ImageError(f"{path}: values from {values.min():g} to {values.max():g}; expected 0 to 1 or 16 bit")
    return scaled
