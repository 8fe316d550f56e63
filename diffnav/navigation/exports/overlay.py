"""A georeferenced map as a small north-up picture for a browser's map."""

import base64
import io
from dataclasses import dataclass

import cv2
import numpy as np
import torch
from PIL import Image
from torch.nn.functional import interpolate

from diffnav.data.maps.geo_map import GeoMap
from diffnav.geometry.georeference import Georeference
from diffnav.images import resize, to_uint8
from diffnav.navigation.exports.antimeridian import unwrapped_deg

# Where pixels are looked up exactly, per side; between them they are interpolated.
_NODES = 129
# Points along each side of a map's outline.
_OUTLINE = 33
_QUALITY = 80
# Reduced pixels by which a map may miss its rectangle before the rest is made transparent.
_SLACK_PX = 1.0


@dataclass(frozen=True)
class Overlay:
    """A picture between parallels and meridians, its rows evenly spaced in Web Mercator.

    uri: the picture itself, `data:image/...`. south, west, north, east: degrees, of its outer edge; longitudes go on
    beyond 180 where the map does.
    """

    uri: str
    south: float
    west: float
    north: float
    east: float


def map_overlay(geo_map: GeoMap, side_px: int = 2000, meridian: float | None = None) -> Overlay:
    """The map resampled north-up, at most `side_px` a side.

    JPEG, or WebP where the map is turned: what lies beside it is then transparent. meridian: longitudes come within
    180 degrees of it; by default of the map's middle. The map is read in strips.
    Raises: ImageError if the map cannot be read.
    """
    georeference = geo_map.georeference
    height, width = georeference.size
    middle = _latlon(georeference, np.array([[(width - 1) / 2, (height - 1) / 2]]))[0]
    meridian = float(middle[1]) if meridian is None else unwrapped_deg(float(middle[1]), meridian)
    outline = _latlon(georeference, _outline(height, width))
    x = np.array([unwrapped_deg(longitude, meridian) for longitude in outline[:, 1].tolist()])
    y = _mercator_deg(outline[:, 0])
    west, east, south, north = x.min(), x.max(), y.min(), y.max()
    factor = max(1, -(-max(height, width) // side_px))
    reduced = _reduced(geo_map, factor)
    size = _overlay_size(georeference, (east - west, north - south), factor, side_px)
    pixels = _pixels(georeference, (west, east, south, north), size)
    picture = _sampled(reduced, pixels, factor, (height, width))
    bottom, top = _latitude_deg(np.array([south, north])).tolist()
    return Overlay(_data_uri(picture), bottom, float(west), top, float(east))


def _outline(height: int, width: int) -> np.ndarray:
    """Points (N, 2) along the outer edge of the outer pixels."""
    share = np.linspace(0, 1, _OUTLINE)
    across, down = share * width - 0.5, share * height - 0.5
    left, right, top, bottom = (np.full(_OUTLINE, value) for value in (-0.5, width - 0.5, -0.5, height - 0.5))
    sides = [(across, top), (across, bottom), (left, down), (right, down)]
    return np.concatenate([np.stack(side, 1) for side in sides])


def _latlon(georeference: Georeference, points: np.ndarray) -> np.ndarray:
    return np.asarray(georeference.latlon(points), dtype=np.float64)


def _mercator_deg(latitude: np.ndarray) -> np.ndarray:
    """Web Mercator's northing in degrees of longitude at the equator."""
    return np.degrees(np.arcsinh(np.tan(np.radians(latitude))))


def _latitude_deg(northing: np.ndarray) -> np.ndarray:
    return np.degrees(np.arctan(np.sinh(np.radians(northing))))


def _reduced(geo_map: GeoMap, factor: int) -> np.ndarray:
    """The map shrunk by a whole factor, area-averaged, (h // factor, w // factor, 3) uint8; read strip by strip."""
    height, width = geo_map.size
    rows, columns = max(1, height // factor), max(1, width // factor)
    deep = max(1, 256 // factor)
    strips = []
    for top in range(0, rows, deep):
        count = min(deep, rows - top)
        strip = geo_map.read((top * factor, 0, min(count * factor, height), min(columns * factor, width)))
        strips.append(to_uint8(resize(strip, (count, columns))))
    return np.concatenate(strips)


def _overlay_size(
    georeference: Georeference, extent: tuple[float, float], factor: int, side_px: int
) -> tuple[int, int]:
    """(h, w) at which the overlay's pixels are as large as the reduced map's in its middle, at most `side_px`."""
    height, width = georeference.size
    centre = np.array([(width - 1) / 2, (height - 1) / 2])
    places = _latlon(georeference, centre + np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    x = np.array([unwrapped_deg(longitude, places[0, 1]) for longitude in places[:, 1].tolist()])
    y = _mercator_deg(places[:, 0])
    steps = np.hypot(x[1:] - x[0], y[1:] - y[0])
    pitch = max(factor * float(steps.min()), max(extent) / side_px)
    wide, high = (max(1, min(side_px, round(side / pitch))) for side in extent)
    return high, wide


def _pixels(georeference: Georeference, limits: tuple[float, float, float, float], size: tuple[int, int]) -> np.ndarray:
    """The map's pixels (h, w, 2) x, y at the centres of the overlay's pixels."""
    west, east, south, north = limits
    high, wide = size
    x = west + (np.linspace(0, wide - 1, _NODES) + 0.5) / wide * (east - west)
    y = north - (np.linspace(0, high - 1, _NODES) + 0.5) / high * (north - south)
    longitude, northing = np.meshgrid(x, y)
    places = np.stack([_latitude_deg(northing), longitude], -1).reshape(-1, 2)
    nodes = torch.from_numpy(np.asarray(georeference.pixels(places), dtype=np.float64))
    grid = nodes.reshape(1, _NODES, _NODES, 2).permute(0, 3, 1, 2)
    return interpolate(grid, (high, wide), mode="bilinear", align_corners=True)[0].permute(1, 2, 0).numpy()


def _sampled(reduced: np.ndarray, pixels: np.ndarray, factor: int, size: tuple[int, int]) -> np.ndarray:
    """The overlay (h, w, 3) uint8, or with alpha (h, w, 4) where parts of it lie beside the map of `size`."""
    x, y = ((pixels[..., axis].astype(np.float64) + 0.5) / factor - 0.5 for axis in (0, 1))
    colours = cv2.remap(
        reduced, x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    beyond = np.zeros(x.shape)
    for values, side in ((pixels[..., 0], size[1]), (pixels[..., 1], size[0])):
        beyond = np.maximum(beyond, np.maximum(-0.5 - values, values - (side - 0.5)))
    if beyond.max() <= _SLACK_PX * factor:
        return colours
    return np.dstack([colours, np.where(beyond <= 0, 255, 0).astype(np.uint8)])


def _data_uri(picture: np.ndarray) -> str:
    kind = "JPEG" if picture.shape[2] == 3 else "WEBP"
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, format=kind, quality=_QUALITY)
    return f"data:image/{kind.lower()};base64,{base64.b64encode(buffer.getvalue()).decode()}"
