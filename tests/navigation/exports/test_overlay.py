"""A map as a browser's picture: where its pixels come to lie, computed here by other formulas."""

import base64
import io
import math

import numpy as np
import pytest
import torch
from PIL import Image

from diffnav.data.maps.geo_map import GeoMap
from diffnav.geometry.georeference import AffineGeoreference, Degrees, LocalMetres
from diffnav.images import ImageError
from diffnav.navigation.exports.overlay import map_overlay


def map_of(picture, georeference, windows=None):
    def read(window):
        top, left, height, width = window
        if windows is not None:
            windows.append(window)
        assert top + height <= picture.shape[1]
        assert left + width <= picture.shape[2]
        return picture[:, top : top + height, left : left + width]

    return GeoMap("m", georeference, read, "f")


def degrees_map(picture, north, west, south, east, windows=None):
    """Rows evenly spaced in latitude."""
    height, width = picture.shape[1:]
    dx, dy = (east - west) / width, (south - north) / height
    transform = (dx, 0.0, west + dx / 2, 0.0, dy, north + dy / 2)
    return map_of(picture, AffineGeoreference((height, width), Degrees(), transform), windows)


def decoded(uri):
    kind, data = uri.split(";base64,")
    picture = Image.open(io.BytesIO(base64.b64decode(data)))
    assert kind == f"data:image/{picture.format.lower()}"
    return np.asarray(picture)


def stripe(height, width, rows):
    picture = torch.zeros(3, height, width)
    picture[:, rows] = 1
    return picture


def test_a_north_up_map_is_a_jpeg_in_its_bounds():
    # Colours that differ from left to right and from top to bottom.
    picture = torch.zeros(3, 80, 120)
    picture[0, :, 60:] = 1
    picture[2, 40:] = 1
    overlay = map_overlay(degrees_map(picture, 10.001, 20.0, 10.0, 20.0015))
    assert overlay.uri.startswith("data:image/jpeg")
    assert (overlay.south, overlay.north) == (pytest.approx(10.0), pytest.approx(10.001))
    assert (overlay.west, overlay.east) == (pytest.approx(20.0), pytest.approx(20.0015))
    levels = decoded(overlay.uri)
    height, width = levels.shape[:2]
    # Degrees of longitude are shorter than those of latitude at 10 degrees: cos(10 degrees) = .985.
    assert width / height == pytest.approx(1.5 * math.cos(math.radians(10)), abs=0.03)
    for row, blue in ((height // 4, 0), (3 * height // 4, 255)):
        for column, red in ((width // 4, 0), (3 * width // 4, 255)):
            assert levels[row, column].tolist() == pytest.approx([red, 0, blue], abs=12)


def test_rows_are_spaced_as_a_browser_map_needs():
    """The parallel of 55 degrees is half-way from 50 to 60 in degrees, but not in Web Mercator."""
    overlay = map_overlay(degrees_map(stripe(400, 100, slice(199, 201)), 60.0, 0.0, 50.0, 2.5))
    levels = decoded(overlay.uri)
    row = float(np.average(np.arange(len(levels)), weights=levels[:, levels.shape[1] // 2, 0].astype(float) ** 2))

    def northing(latitude):
        return math.log(math.tan(math.pi / 4 + math.radians(latitude) / 2))

    expected = (northing(60) - northing(55)) / (northing(60) - northing(50))
    assert abs(expected - 0.5) > 0.03
    assert (row + 0.5) / len(levels) == pytest.approx(expected, abs=0.003)


def test_a_turned_map_lies_north_up_and_clear_beside_itself():
    picture = torch.full((3, 200, 200), 0.5)
    picture[:, 20:40, 20:40] = torch.tensor([1.0, 0.0, 0.0])[:, None, None]
    turn = math.radians(30)
    # One metre a pixel, its x axis 30 degrees north of east, its middle at the origin.
    a, d, b, e = math.cos(turn), math.sin(turn), math.sin(turn), -math.cos(turn)
    transform = (a, b, -99.5 * (a + b), d, e, -99.5 * (d + e))
    overlay = map_overlay(map_of(picture, AffineGeoreference((200, 200), LocalMetres((0.0, 0.0)), transform)))
    assert overlay.uri.startswith("data:image/webp")
    levels = decoded(overlay.uri)
    height, width = levels.shape[:2]
    # The square's box: 200 (cos 30 + sin 30) metres a side, at the equator.
    metre_deg = math.degrees(1 / 6_371_008.8)
    side = 200 * (math.cos(turn) + math.sin(turn)) * metre_deg
    assert overlay.east - overlay.west == pytest.approx(side, rel=1e-6)
    assert overlay.north - overlay.south == pytest.approx(side, rel=1e-6)
    for corner in ((3, 3), (3, width - 4), (height - 4, 3), (height - 4, width - 4)):
        assert levels[corner][3] == 0
    assert levels[height // 2, width // 2].tolist() == pytest.approx([128, 128, 128, 255], abs=12)
    # Pixel (29.5, 29.5), seen from the middle, in metres east and north.
    east, north = (sum(p) * -70.0 for p in ((a, b), (d, e)))
    column = ((east * metre_deg - overlay.west) / side) * width
    row = ((overlay.north - north * metre_deg) / side) * height
    assert levels[int(row), int(column)].tolist() == pytest.approx([255, 0, 0, 255], abs=40)


def test_a_map_across_the_antimeridian_goes_on_beyond_180():
    across = degrees_map(torch.rand(3, 20, 40), 1.0, 179.0, 0.0, 181.0)
    overlay = map_overlay(across)
    assert overlay.east - overlay.west == pytest.approx(2)
    assert overlay.west % 360 == pytest.approx(179)
    overlay = map_overlay(across, meridian=-178.0)
    assert (overlay.west, overlay.east) == (pytest.approx(-181.0), pytest.approx(-179.0))
    beside = map_overlay(degrees_map(torch.rand(3, 20, 40), 1.0, -177.0, 0.0, -175.0), meridian=179.0)
    assert (beside.west, beside.east) == (pytest.approx(183.0), pytest.approx(185.0))


def test_a_large_map_is_shrunk_by_averaging_and_read_in_strips():
    windows = []
    picture = torch.zeros(3, 999, 1501)
    picture[:, :, ::2] = 1
    overlay = map_overlay(degrees_map(picture, 0.1, 0.0, 0.0, 0.15, windows), side_px=100)
    levels = decoded(overlay.uri)
    assert max(levels.shape[:2]) <= 100
    assert max(levels.shape[:2]) > 80
    # Columns of black and white become grey, not stripes.
    assert np.abs(levels[5:-5, 5:-5].astype(float) - 127.5).max() < 20
    assert len(windows) > 1
    assert max(window[2] for window in windows) <= 256


def test_tiny_maps_work():
    levels = decoded(map_overlay(degrees_map(torch.full((3, 1, 1), 0.5), 0.001, 0.0, 0.0, 0.001)).uri)
    assert levels.reshape(-1, 3).mean() == pytest.approx(128, abs=3)


def test_a_map_that_cannot_be_read_says_so():
    def broken(_window):
        raise ImageError("map.jpg: damaged image")

    georeference = degrees_map(torch.zeros(3, 20, 20), 1.0, 0.0, 0.0, 1.0).georeference
    with pytest.raises(ImageError, match=r"map\.jpg"):
        map_overlay(GeoMap("m", georeference, broken, "f"))
