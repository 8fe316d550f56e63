"""Files <-> RGB float tensors: the only place that knows uint8, EXIF, 16 bit, palettes, alpha and CMYK.

Images are float32 RGB tensors `(3, H, W)` in [0, 1] unless a docstring says otherwise.
"""

import io
import os
import warnings
from pathlib import Path

import cv2
import numpy as np
import torch
from PIL import Image, ImageFile, ImageOps, UnidentifiedImageError
from torch import Tensor

from diffnav.errors import UserError

IMAGE_SUFFIXES = frozenset({".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".webp", ".ppm", ".pgm"})
_WIDE_MODES = frozenset({"I", "I;16", "I;16L", "I;16B", "I;16N", "F"})
# Satellite maps pass Pillow's guard against decompression bombs (89 Mpx); this one still stops absurd sizes.
MAX_PIXELS = 1_000_000_000


class ImageError(UserError):
    """An image file that cannot be used; the sentence names it and says why."""


def find_images(folder: Path) -> list[Path]:
    """All image files below `folder`, sorted by path; hidden files and other kinds are passed over.

    Raises: UserError if the folder is missing or holds no image.
    """
    folder = Path(folder).expanduser()
    if not folder.is_dir():
        raise UserError(f"no folder {folder}: give an existing folder of images")
    # os.walk, not rglob: links to folders are followed, as users of shared data disks expect.
    found = sorted(
        Path(root) / name
        for root, _, names in os.walk(folder, followlinks=True)
        for name in names
        if Path(name).suffix.lower() in IMAGE_SUFFIXES and not name.startswith(".")
    )
    if not found:
        kinds = " ".join(sorted(IMAGE_SUFFIXES))
        raise UserError(f"no images in {folder}: it should hold files of the kinds {kinds}")
    return found


def read_image(path: Path, upright: bool = True) -> Tensor:
    """The picture in a file as (3, H, W) float32 RGB in [0, 1].

    Grey becomes three equal channels, 16 bit is scaled by 65,535, palette and CMYK are converted, alpha is laid
    over black, floating-point files must lie in [0, 1]. `upright` turns the picture as its EXIF orientation says.

    Raises: ImageError if the file is missing, truncated, or no image.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            Image.MAX_IMAGE_PIXELS = MAX_PIXELS
            ImageFile.LOAD_TRUNCATED_IMAGES = False
            with Image.open(path) as file:
                picture = ImageOps.exif_transpose(file) if upright else file
                picture.load()
                return _to_tensor(picture, path)
    except FileNotFoundError:
        raise ImageError(f"{path}: no such file") from None
    except UnidentifiedImageError:
        raise ImageError(f"{path}: not an image that can be read; remove it or save it again") from None
    except ImageError:
        raise
    except Image.DecompressionBombError:
        raise ImageError(f"{path}: more than {2 * MAX_PIXELS:,} pixels; cut it into smaller images") from None
    except (OSError, SyntaxError, ValueError, EOFError, IndexError, TypeError) as error:
        raise ImageError(f"{path}: damaged image ({error}); replace or remove it") from None


def _to_tensor(picture: Image.Image, path: Path) -> Tensor:
    if picture.mode in _WIDE_MODES:
        return _wide_to_tensor(picture, path)
    if picture.mode in ("RGBA", "LA", "PA", "RGBa", "La") or "transparency" in picture.info:
        rgba = picture.convert("RGBA")
        black = Image.new("RGBA", rgba.size, (0, 0, 0, 255))
        picture = Image.alpha_composite(black, rgba)
    return from_uint8(np.asarray(picture.convert("RGB")))


def _wide_to_tensor(picture: Image.Image, path: Path) -> Tensor:
    values = np.asarray(picture).astype(np.float32)
    if not np.isfinite(values).all():
        raise ImageError(f"{path}: holds NaN or infinite values; save it with values from 0 to 1")
    if picture.mode != "F":
        values = values / 65535.0
    if values.min() < 0 or values.max() > 1:
        raise ImageError(f"{path}: values from {values.min():g} to {values.max():g}; expected 0 to 1 or 16 bit")
    return torch.from_numpy(values).expand(3, -1, -1).contiguous()


def read_exif(path: Path) -> bytes:
    """The file's EXIF block with the orientation tag reset to upright; empty if there is none.

    Raises: ImageError if the file is no image.
    """
    try:
        with Image.open(path) as file:
            exif = file.getexif()
    except (OSError, SyntaxError, ValueError) as error:
        raise ImageError(f"{path}: not an image that can be read ({error})") from None
    exif.pop(0x0112, None)
    return exif.tobytes() if len(exif) else b""


def write_image(path: Path, image: Tensor, quality: int = 95, exif: bytes = b"") -> None:
    """Write (3, H, W) in [0, 1] to `path` in the format its ending names; the file appears whole or not at all.

    Raises: UserError if the ending names no writable image format or the folder cannot be written.
    """
    path = Path(path)
    kind = Image.registered_extensions().get(path.suffix.lower())
    if path.suffix.lower() not in IMAGE_SUFFIXES or kind is None:
        raise UserError(f"{path}: cannot write images that end in '{path.suffix}'; use .jpg or .png")
    options: dict = {"exif": exif} if exif and kind in ("JPEG", "PNG", "WEBP", "TIFF") else {}
    if kind in ("JPEG", "WEBP"):
        options["quality"] = quality
    aside = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(to_uint8(image)).save(aside, format=kind, **options)
        os.replace(aside, path)
    except OSError as error:
        aside.unlink(missing_ok=True)
        raise UserError(f"{path}: cannot be written ({error.strerror or error})") from None


def to_uint8(image: Tensor) -> np.ndarray:
    """(3, H, W) in [0, 1] -> (H, W, 3) uint8, rounded to the nearest level, clipped."""
    levels = (image.detach().float().clamp(0, 1) * 255).round().to(torch.uint8)
    return np.ascontiguousarray(levels.permute(1, 2, 0).cpu().numpy())


def from_uint8(array: np.ndarray) -> Tensor:
    """(H, W, 3) uint8 -> (3, H, W) float32 in [0, 1]."""
    return torch.from_numpy(np.array(array, copy=True)).permute(2, 0, 1).contiguous().float() / 255


def quantise(image: Tensor) -> Tensor:
    """The image rounded to 8 bit: (…) in [0, 1] -> the same shape on the grid of 1/255."""
    return (image.clamp(0, 1) * 255).round() / 255


def jpeg_round_trip(levels: np.ndarray, quality: int) -> np.ndarray:
    """(H, W, 3) uint8 RGB -> the same after one JPEG encoding (4:2:0 chroma) and decoding."""
    buffer = io.BytesIO()
    Image.fromarray(levels).save(buffer, format="JPEG", quality=quality)
    with Image.open(buffer) as decoded:
        return np.asarray(decoded.convert("RGB"))


def resize(image: Tensor, size: tuple[int, int]) -> Tensor:
    """(3, H, W) -> (3, h, w) for `size` (h, w): area filter when shrinking, bicubic when growing (D27)."""
    height, width = size
    if image.shape[1:] == (height, width):
        return image
    shrinks = height <= image.shape[1] and width <= image.shape[2]
    pixels = image.permute(1, 2, 0).numpy()
    scaled = cv2.resize(pixels, (width, height), interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_CUBIC)
    return torch.from_numpy(scaled).permute(2, 0, 1).clamp(0, 1).contiguous()
