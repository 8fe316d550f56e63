"""Files <-> RGB float tensors: with `decoding`, the only place that knows uint8, EXIF, 16 bit, alpha, CMYK.

Images are float32 RGB tensors `(3, H, W)` in [0, 1] unless a docstring says otherwise.
"""

import io
import os
import warnings
from pathlib import Path

import cv2
import numpy as np
import torch
from PIL import Image, UnidentifiedImageError
from torch import Tensor

from diffnav.decoding import MAX_PIXELS, ORIENTATION_TAG, ImageError, decode
from diffnav.errors import UserError

IMAGE_SUFFIXES = frozenset({".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".webp", ".ppm", ".pgm"})
# EXIF orientation -> axes of (3, H, W) to flip; from 5 on rows and columns are exchanged first.
_FLIPS = {2: (2,), 3: (1, 2), 4: (1,), 6: (2,), 7: (1, 2), 8: (1,)}
# Below tag 700 a TIFF's directory describes its own pixels, wrong for any other file, except for these:
# names, description, camera, resolution, software, time, artist.
_TIFF_KEPT = frozenset({269, 270, 271, 272, 282, 283, 296, 305, 306, 315, 316})
# The colour profile: of CMYK or grey it would spoil the RGB written here.
_PROFILE_TAG = 34675


def find_images(folder: Path) -> list[Path]:
    """All image files below `folder`, sorted by path; what is hidden or of another kind is passed over.

    Raises: UserError if the folder is missing or holds no image.
    """
    folder = Path(folder).expanduser()
    if not folder.is_dir():
        raise UserError(f"no folder {folder}: give an existing folder of images")
    found: list[Path] = []
    seen: set[str] = set()
    # os.walk, not rglob: links to folders are followed, as users of shared disks expect, none of them twice.
    for root, folders, names in os.walk(folder, followlinks=True):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        real = os.path.realpath(root)
        if real in seen:
            folders.clear()
            continue
        seen.add(real)
        found += [
            Path(root) / name
            for name in names
            if Path(name).suffix.lower() in IMAGE_SUFFIXES and not name.startswith(".")
        ]
    if not found:
        kinds = " ".join(sorted(IMAGE_SUFFIXES))
        raise UserError(f"no images in {folder}: it should hold files of the kinds {kinds}")
    return sorted(found)


def read_image(path: Path) -> Tensor:
    """The picture in a file as (3, H, W) float32 RGB in [0, 1], upright as its EXIF orientation says.

    Grey becomes three equal channels, 16 bit is scaled by 65,535, palette and CMYK are converted, alpha is
    laid over black, floating-point files must lie in [0, 1].

    Raises: ImageError if the file is missing, truncated, or no image.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image, orientation = decode(Path(path))
    except ImageError:
        raise
    except FileNotFoundError:
        raise ImageError(f"{path}: no such file") from None
    except UnidentifiedImageError:
        raise ImageError(f"{path}: not an image that can be read; remove it or save it again") from None
    except Image.DecompressionBombError:
        raise ImageError(f"{path}: more than {2 * MAX_PIXELS:,} pixels; cut it into smaller images") from None
    except Exception as error:  # each decoder fails in its own way: struct.error, zlib.error, cv2.error, ...
        if isinstance(error, OSError) and error.strerror:
            raise ImageError(f"{path}: cannot be read ({error.strerror})") from None
        reason = " ".join((str(error) or type(error).__name__).split())
        raise ImageError(f"{path}: damaged image ({reason}); replace or remove it") from None
    if orientation >= 5:
        image = image.transpose(1, 2)
    flips = _FLIPS.get(orientation)
    return (image.flip(flips) if flips else image).contiguous()


def read_exif(path: Path) -> bytes:
    """The file's EXIF block with the orientation reset to upright; empty if none can be read."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(path) as file:
                exif = file.getexif()
                layout = {tag for tag in exif if tag < 700 and tag not in _TIFF_KEPT} | {_PROFILE_TAG}
                for tag in layout if file.format == "TIFF" else {ORIENTATION_TAG}:
                    exif.pop(tag, None)
                return exif.tobytes() if len(exif) else b""
    except Exception:  # a damaged block raises anything; the picture is worth more than its tags
        return b""


def write_image(path: Path, image: Tensor, quality: int = 95, exif: bytes = b"") -> None:
    """Write (3, H, W) in [0, 1] to `path` in the format its ending names; whole or not at all.

    Raises: UserError if the ending names no writable image format or the folder cannot be written.
    """
    path = Path(path)
    kind = Image.registered_extensions().get(path.suffix.lower())
    if path.suffix.lower() not in IMAGE_SUFFIXES or kind is None:
        raise UserError(f"{path}: cannot write images that end in '{path.suffix}'; use .jpg or .png")
    options: dict = {"exif": exif} if exif and kind in ("JPEG", "PNG", "WEBP", "TIFF") else {}
    if kind in ("JPEG", "WEBP"):
        options["quality"] = quality
    # Named after the process: two of them may write the same picture.
    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            Image.fromarray(to_uint8(image)).save(aside, format=kind, **options)
            os.replace(aside, path)
        finally:
            aside.unlink(missing_ok=True)
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise UserError(f"{path}: cannot be written ({reason})") from None


def to_uint8(image: Tensor) -> np.ndarray:
    """(3, H, W) in [0, 1] -> (H, W, 3) uint8, rounded to the nearest level, clipped."""
    # In place: a satellite map's copies would count.
    levels = image.detach().float().clamp(0, 1).mul_(255).round_().to(torch.uint8)
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
    """(3, H, W) -> (3, h, w) for `size` (h, w): area filter where it shrinks, bicubic where it grows (D27).

    A pixel's centre x goes to (x + 0.5) w / W - 0.5.
    """
    pixels = image.permute(1, 2, 0).numpy()
    shrunk = min(size[0], image.shape[1]), min(size[1], image.shape[2])
    for (height, width), method in ((shrunk, cv2.INTER_AREA), (size, cv2.INTER_CUBIC)):
        if pixels.shape[:2] != (height, width):
            pixels = cv2.resize(pixels, (width, height), interpolation=method)
    return torch.from_numpy(pixels).permute(2, 0, 1).clamp(0, 1).contiguous()


def shrink(image: Tensor, longest_side: int) -> Tensor:
    """(3, H, W) with its longest side at most so many pixels; a smaller image comes back as it is."""
    share = longest_side / max(image.shape[1:])
    if share >= 1:
        return image
    return resize(image, (max(1, round(image.shape[1] * share)), max(1, round(image.shape[2] * share))))
