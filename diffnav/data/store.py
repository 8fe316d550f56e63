"""Photos in memory, each file read and checked once before training starts."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from torch import Tensor
from tqdm import tqdm

from diffnav.data.photos import Photo
from diffnav.errors import UserError
from diffnav.images import ImageError, resize, to_uint8


class PhotoStore:
    """The pictures of a list of photos as uint8 arrays (H, W, 3), with those that cannot be used left out.

    photos: the usable ones, in order. normal, low: their pictures (low is None where Eq. 9 makes the darkness).
    maximum: each daylight picture's largest value, in [0, 1]. problems: one sentence per photo left out.

    Raises: UserError if no photo is usable or `size` is not two numbers of pixels.
    """

    def __init__(
        self, photos: Sequence[Photo], size: tuple[int, int] | None, smallest: int, progress: bool = False
    ) -> None:
        if size is not None and (len(size) != 2 or not all(isinstance(side, int) and side > 0 for side in size)):
            raise UserError(f"data.size must be [height, width] in pixels or null, got {list(size)}")
        self.photos: list[Photo] = []
        self.normal: list[np.ndarray] = []
        self.low: list[np.ndarray | None] = []
        self.problems: list[str] = []
        for photo in tqdm(photos, desc="reading photos", unit="photo", disable=not progress, leave=False):
            try:
                normal, low = _read(photo, size, smallest)
            except ImageError as error:
                self.problems.append(str(error))
                continue
            self.photos.append(photo)
            self.normal.append(normal)
            self.low.append(low)
        if not self.photos:
            if len(self.problems) == 1:
                raise UserError(self.problems[0])
            first = f"; the first: {self.problems[0]}" if self.problems else ""
            raise UserError(f"none of {len(photos)} photos can be used{first}")
        self.maximum = [float(levels.max()) / 255 for levels in self.normal]

    def __len__(self) -> int:
        return len(self.photos)


def _read(photo: Photo, size: tuple[int, int] | None, smallest: int) -> tuple[np.ndarray, np.ndarray | None]:
    normal = photo.read_normal()
    low = photo.read_low() if photo.low else None
    if low is not None and low.shape != normal.shape:
        raise ImageError(f"{photo.low}: {_wh(low)} pixels, its daylight picture has {_wh(normal)}; make them equal")
    if size is not None:
        normal = resize(normal, size)
        low = resize(low, size) if low is not None else None
    if min(normal.shape[1:]) < smallest:
        file = photo.normal if isinstance(photo.normal, Path) else photo.name
        raise ImageError(
            f"{file}: {_wh(normal)} pixels, less than the {smallest} x {smallest} needed; "
            "set data.size to enlarge it, or train on a smaller data.patch"
        )
    return to_uint8(normal), to_uint8(low) if low is not None else None


def _wh(image: Tensor) -> str:
    return f"{image.shape[2]} x {image.shape[1]}"
