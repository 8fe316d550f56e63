"""A piece of ground as one north-up picture, drawn from all maps that show it."""

import math
from collections.abc import Sequence

import cv2
import numpy as np
import torch
from torch import Tensor

from diffnav.data.maps.geo_map import GeoMap
from diffnav.images import resize
from diffnav.navigation.ground import Ground


def ground_picture(maps: Sequence[GeoMap], ground: Ground, size: tuple[int, int]) -> tuple[Tensor, Tensor]:
    """The picture (3, h, w) of the ground's first h x w pixels, and which of them (h, w) a map shows; black elsewhere.

    Where maps overlap, the first counts. Raises: ImageError for an unreadable map.
    """
    picture, shown = torch.zeros(3, *size), torch.zeros(size, dtype=torch.bool)
    places = ground.latlon(
        np.stack(np.meshgrid(np.arange(size[1]), np.arange(size[0])), -1).reshape(-1, 2).astype(float)
    )
    for geo_map in maps:
        pixels = geo_map.georeference.pixels(places).reshape(*size, 2)
        height, width = geo_map.size
        new = ((pixels >= -0.5) & (pixels <= [width - 0.5, height - 0.5])).all(-1) & ~shown.numpy()
        if new.any():
            picture[:, torch.from_numpy(new)] = _drawn(geo_map, pixels, new)
            shown |= torch.from_numpy(new)
    return picture, shown


def _drawn(geo_map: GeoMap, pixels: np.ndarray, new: np.ndarray) -> Tensor:
    """The map's colours (3, n) at its pixels (h, w, 2) where `new`; shrunk first where many map pixels fall on one."""
    height, width = geo_map.size
    step = np.median(np.linalg.norm(np.diff(pixels, axis=1), axis=-1)) if pixels.shape[1] > 1 else 1.0
    # A pixel more of the shrunk map all around, to draw between.
    margin = math.ceil(step) + 1
    low = np.clip(np.floor(pixels[new].min(0)).astype(int) - margin, 0, [width - 1, height - 1])
    high = np.clip(np.ceil(pixels[new].max(0)).astype(int) + margin + 1, 1, [width, height])
    window = geo_map.read((int(low[1]), int(low[0]), int(high[1] - low[1]), int(high[0] - low[0])))
    points = pixels - low
    if step > 1.5:
        small = tuple(max(1, round(side / step)) for side in window.shape[1:])
        scale = np.array([small[1] / window.shape[2], small[0] / window.shape[1]])
        window, points = resize(window, (small[0], small[1])), (points + 0.5) * scale - 0.5
    x, y = (np.ascontiguousarray(points[..., axis].astype(np.float32)) for axis in (0, 1))
    drawn = cv2.remap(window.permute(1, 2, 0).numpy(), x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return torch.from_numpy(drawn[new].T)
