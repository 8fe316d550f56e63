"""A piece of ground drawn from maps: each of its pixels where it belongs, whatever the maps' pixels measure."""

import math

import numpy as np
import pytest
import torch
from made_maps import DEGREE_M, ORIGIN, picture_map
from made_noise import noise

from diffnav.data.maps.geo_map import GeoMap, Window
from diffnav.geometry.georeference import AffineGeoreference, LocalMetres
from diffnav.navigation.ground import Ground
from diffnav.navigation.mosaic import ground_picture

Transform = tuple[float, float, float, float, float, float]


def ramp(name: str, size: tuple[int, int], transform: Transform, blue: float = 0.0) -> GeoMap:
    """Red tells the metres to the east, 0 to 200; green those to the north, -200 to 0."""
    a, b, c, d, e, f = transform

    def read(window: Window) -> torch.Tensor:
        top, left, height, width = window
        assert top >= 0
        assert left >= 0
        assert top + height <= size[0]
        assert left + width <= size[1]
        y, x = torch.meshgrid(torch.arange(top, top + height), torch.arange(left, left + width), indexing="ij")
        east, north = a * x + b * y + c, d * x + e * y + f
        return torch.stack([east / 200, north / 200 + 1, torch.full_like(east, blue)])

    return GeoMap(name, AffineGeoreference(size, LocalMetres(ORIGIN), transform), read, name)


def ground_at(east: float, north: float, pixel_m: float) -> Ground:
    latitude = ORIGIN[0] + north / DEGREE_M
    longitude = ORIGIN[1] + east / (DEGREE_M * math.cos(math.radians((ORIGIN[0] + latitude) / 2)))
    return Ground((latitude, longitude), pixel_m)


def check_colours(picture: torch.Tensor, shown: torch.Tensor, corner: tuple[float, float], pixel_m: float) -> None:
    """What is shown has the colour of its place, to a tenth of a metre."""
    height, width = shown.shape
    east = corner[0] + pixel_m * torch.arange(width).expand(height, -1)
    north = corner[1] - pixel_m * torch.arange(height)[:, None].expand(-1, width)
    assert ((picture[0] * 200 - east).abs()[shown] < 0.1).all()
    assert ((picture[1] * 200 - 200 - north).abs()[shown] < 0.1).all()
    assert (picture[:, ~shown] == 0).all()


@pytest.mark.parametrize("pixel_m", [0.5, 0.2, 0.7, 2.0, 3.3])
@pytest.mark.parametrize(
    "transform",
    [(0.5, 0.0, 20.0, 0.0, -0.5, -20.0), (0.4, 0.3, 20.0, 0.3, -0.4, -60.0)],
    ids=["north up", "turned"],
)
def test_each_pixel_shows_its_place(pixel_m: float, transform: Transform) -> None:
    """Inside of the map: at its edge, where pixels are averaged, half a ground pixel of it is missing."""
    geo_map = ramp("ramp", (240, 260), transform)
    side = round(90 / pixel_m)
    picture, shown = ground_picture([geo_map], ground_at(55, -45, pixel_m), (side, side))
    inner = shown.clone()
    if not shown.all():
        hidden = torch.nn.functional.max_pool2d((~shown).float()[None], 3, 1, 1)[0]
        inner &= hidden == 0
    assert inner.float().mean() > 0.5
    picture = torch.where(inner, picture, 0)
    check_colours(picture, inner, (55, -45), pixel_m)


def test_what_a_map_shows_ends_half_a_pixel_beyond_its_outermost_centres() -> None:
    """A map of 40 x 30 pixels of 1 m whose first centre is the ground's pixel (10, 5), in ground pixels of .5 m."""
    geo_map = ramp("ramp", (30, 40), (1.0, 0.0, 50.0, 0.0, -1.0, -50.0))
    _, shown = ground_picture([geo_map], ground_at(50.1 - 5, -50.1 + 2.5, 0.5), (80, 120))
    # Centres at 10 - .2, every second pixel; the edges at 8.8 and 88.8, downwards at 4.2 - .. in the same way.
    columns, rows = shown.any(0).nonzero().ravel(), shown.any(1).nonzero().ravel()
    assert (columns.min(), columns.max()) == (9, 88)
    assert (rows.min(), rows.max()) == (4, 63)
    assert shown[4:64, 9:89].all()


def test_where_maps_overlap_the_first_counts() -> None:
    one = ramp("one", (100, 100), (1.0, 0.0, 0.0, 0.0, -1.0, 0.0), blue=0.25)
    other = ramp("other", (200, 200), (0.7, 0.0, 60.0, 0.0, -0.7, -40.0), blue=0.75)
    for maps in ((one, other), (other, one)):
        picture, shown = ground_picture(maps, ground_at(5, -5, 1.0), (190, 190))
        east, north = torch.arange(190) + 5.0, -torch.arange(190)[:, None] - 5.0
        by_one = (east < 99.5) & (north > -99.5)
        by_other = (east > 59.65) & (east < 199.65) & (north < -39.65) & (north > -179.65)
        assert torch.equal(shown, by_one | by_other)
        first = by_one if maps[0] is one else by_other & ~by_one | by_one & by_other
        assert (picture[2][first] == (0.25 if maps[0] is one else 0.75)).all()
        check_colours(picture, shown, (5, -5), 1.0)


def test_a_coarse_picture_has_no_aliases() -> None:
    """Stripes of one pixel, seen at five metres a pixel where the map has one: grey."""
    stripes = (torch.arange(300) % 2).float().expand(3, 200, -1)
    geo_map = picture_map(stripes, pixel_m=1.0)
    picture, shown = ground_picture([geo_map], ground_at(20, -20, 5.0), (30, 50))
    assert shown.all()
    assert (picture - 0.5).abs().max() < 0.11


def test_the_maps_own_pixels_come_back() -> None:
    picture = noise((60, 80), 3)
    drawn, shown = ground_picture([picture_map(picture)], ground_at(0, 0, 0.5), (60, 80))
    assert shown.all()
    assert torch.allclose(drawn, picture, atol=1e-3)


def test_no_map_shows_the_place() -> None:
    far = ramp("far", (50, 50), (1.0, 0.0, 5000.0, 0.0, -1.0, 5000.0))
    for maps in ([], [far]):
        picture, shown = ground_picture(maps, ground_at(0, 0, 1.0), (20, 30))
        assert picture.shape == (3, 20, 30)
        assert not shown.any()
        assert not picture.any()


def test_one_pixel_and_one_column() -> None:
    geo_map = ramp("ramp", (240, 260), (0.5, 0.0, 20.0, 0.0, -0.5, -20.0))
    for size in ((1, 1), (40, 1), (1, 40)):
        picture, shown = ground_picture([geo_map], ground_at(50, -50, 0.5), size)
        assert shown.all()
        check_colours(picture, shown, (50, -50), 0.5)
    assert np.isfinite(picture.numpy()).all()
