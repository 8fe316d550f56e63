"""Dark and daylight pairs: random patches to train on, whole pictures to measure on."""

import hashlib
import math
from dataclasses import replace
from typing import TypedDict

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import Dataset

from diffnav.darkness import Darkening, DarknessModel, darken
from diffnav.data.store import PhotoStore
from diffnav.data.variation import Variation, expose, shrink_around
from diffnav.images import from_uint8

# Chroma is stored at half resolution in blocks of 8 x 8: JPEG's grid repeats every 16 pixels.
JPEG_GRID = 16


class Pair(TypedDict):
    """low, normal: (3, h, w) in [0, 1], the same view."""

    low: Tensor
    normal: Tensor


class TrainingPairs(Dataset[Pair]):
    """Sample number -> a random patch, dark and in daylight; a pure function of (seed, number), so runs can resume.

    One epoch is one patch of every photo, shuffled. Darkness is drawn anew each time (`augment_darkness`) or once
    per photo, as in the paper; patches are flipped and turned by quarter turns, and go as far beyond the photos as
    `variation` says.
    """

    def __init__(
        self,
        store: PhotoStore,
        darkness: DarknessModel,
        patch: int = 96,
        seed: int = 0,
        augment_darkness: bool = True,
        variation: Variation | None = None,
    ) -> None:
        self.store = store
        self.darkness = darkness
        self.patch = patch
        self.seed = seed
        self.augment_darkness = augment_darkness
        self.variation = variation or Variation()
        self._epoch = -1
        self._order = np.empty(0, dtype=np.int64)

    def __len__(self) -> int:
        """Samples in an epoch; numbers beyond it belong to the following epochs."""
        return len(self.store)

    def __getitem__(self, number: int) -> Pair:
        epoch, place = divmod(number, len(self.store))
        if epoch != self._epoch:
            self._order = np.random.default_rng([self.seed, epoch]).permutation(len(self.store))
            self._epoch = epoch
        index = int(self._order[place])
        dice = np.random.default_rng([self.seed, epoch, index, 1])
        height, width = self.store.normal[index].shape[:2]
        top = int(dice.integers(height - self.patch + 1))
        left = int(dice.integers(width - self.patch + 1))
        drawn = int(dice.integers(2**31))
        seed = drawn if self.augment_darkness else photo_seed(self.seed, self.store.photos[index].name)
        zoom, exposure = self.variation.draw(dice)
        low, normal = self._patch(index, top, left, seed, zoom, exposure)
        turns, flip = int(dice.integers(4)), bool(dice.integers(2))
        return {"low": _turn(low, turns, flip), "normal": _turn(normal, turns, flip)}

    def _patch(self, index: int, top: int, left: int, seed: int, zoom: float, exposure: float) -> tuple[Tensor, Tensor]:
        levels, stored = self.store.normal[index], self.store.low[index]
        if zoom < 1:
            levels = shrink_around(levels, top, left, self.patch, zoom)
            stored = None if stored is None else shrink_around(stored, top, left, self.patch, zoom)
            top = left = 0
        window = np.s_[top : top + self.patch, left : left + self.patch]
        if stored is not None:
            return from_uint8(stored[window]), from_uint8(levels[window])
        maximum = self.store.maximum[index]
        if exposure != 1:
            levels, maximum = expose(levels, exposure), maximum**exposure
        record = self.darkness.draw(maximum, seed)
        return dark_window(levels, top, left, self.patch, record), from_uint8(levels[window])


def dark_window(levels: np.ndarray, top: int, left: int, patch: int, record: Darkening) -> Tensor:
    """The patch of the darkened picture, computed from its surroundings alone: (3, patch, patch).

    Equal to darkening all of `levels` (H, W, 3) and cutting (without noise): the surroundings start on JPEG's grid
    and reach one block further, whose chroma the decoder interpolates, and the blur's radius beyond it.
    """
    blur_radius = math.ceil(record.blur_px / 2) if record.blur_px > 1 else 0
    reach = JPEG_GRID * (1 + math.ceil(blur_radius / JPEG_GRID))
    y0 = max(top // JPEG_GRID * JPEG_GRID - reach, 0)
    x0 = max(left // JPEG_GRID * JPEG_GRID - reach, 0)
    y1 = -(-(top + patch) // JPEG_GRID) * JPEG_GRID + reach
    x1 = -(-(left + patch) // JPEG_GRID) * JPEG_GRID + reach
    dark = darken(from_uint8(levels[y0:y1, x0:x1]), record)
    return dark[:, top - y0 : top - y0 + patch, left - x0 : left - x0 + patch]


class WholePair(Pair):
    """A pair of whole pictures with its photo's name and site, and the record of how it was darkened."""

    name: str
    site: str
    record: Darkening | None


class WholePairs(Dataset[WholePair]):
    """Index -> whole dark and daylight picture, to measure on.

    Each photo's darkness follows from `seed` and its name, whatever other photos are there; pairs with a stored
    dark picture keep it, and its record if there is one. `crop` cuts the centre (h, w) after darkening.
    """

    def __init__(
        self, store: PhotoStore, darkness: DarknessModel, seed: int = 0, crop: tuple[int, int] | None = None
    ) -> None:
        self.store = store
        self.darkness = darkness
        self.seed = seed
        self.crop = crop

    def __len__(self) -> int:
        return len(self.store)

    def __getitem__(self, index: int) -> WholePair:
        photo, stored = self.store.photos[index], self.store.low[index]
        normal = from_uint8(self.store.normal[index])
        if stored is not None:
            low, record = from_uint8(stored), photo.record
        else:
            record = self.darkness.draw(self.store.maximum[index], photo_seed(self.seed, photo.name))
            low = darken(normal, record)
        low, normal = _centre(low, self.crop), _centre(normal, self.crop)
        record = replace(record, normal=normal) if record else None
        return {"low": low, "normal": normal, "name": photo.name, "site": photo.site, "record": record}


def photo_seed(seed: int, name: str) -> int:
    """The seed of one photo's darkness: a hash, so that it does not depend on the other photos."""
    return int.from_bytes(hashlib.sha256(f"{seed}/{name}".encode()).digest()[:4]) & 0x7FFFFFFF


def _turn(image: Tensor, turns: int, flip: bool) -> Tensor:
    turned = torch.rot90(image, turns, (1, 2))
    return (turned.flip(2) if flip else turned).contiguous()


def _centre(image: Tensor, crop: tuple[int, int] | None) -> Tensor:
    if crop is None:
        return image
    height, width = (min(c, s) for c, s in zip(crop, image.shape[1:], strict=True))
    top, left = (image.shape[1] - height) // 2, (image.shape[2] - width) // 2
    return image[:, top : top + height, left : left + width].contiguous()
