"""Views of maps: what is resampled lies where the homography says, without aliases, read from the part needed."""

import math

import pytest
import torch

from diffnav.data.maps.geo_map import GeoMap, Window
from diffnav.data.maps.view import map_view, resampled
from diffnav.data.maps.world import world_maps
from diffnav.geometry.views import draw_view, view_homography

SIZE = (120, 160)
VIEW = (30, 40)


def similarity(angle_rad: float, zoom: float, x: float, y: float) -> torch.Tensor:
    """H (3, 3): the middle (19.5, 14.5) of a view lies at x, y."""
    c, s = zoom * math.cos(angle_rad), zoom * math.sin(angle_rad)
    rows = [[c, -s, x - c * 19.5 + s * 14.5], [s, c, y - s * 19.5 - c * 14.5], [0, 0, 1]]
    return torch.tensor(rows, dtype=torch.float64)


def reader(image: torch.Tensor, seen: list[Window]):
    def read(window: Window) -> torch.Tensor:
        seen.append(window)
        top, left, height, width = window
        return image[:, top : top + height, left : left + width]

    return read


@pytest.mark.parametrize(
    ("angle_rad", "zoom"), [(0.0, 0.4), (0.6, 1.0), (-2.2, 1.7), (1.0, 2.2), (3.0, 2.9), (0.05, 3.3)]
)
def test_a_ramp_is_sampled_exactly(angle_rad: float, zoom: float) -> None:
    """Bilinear samples and means of squares change no plane: a pixel has the value of the point that it maps to."""
    x, y = torch.arange(160.0).expand(120, -1) / 160, torch.arange(120.0)[:, None].expand(-1, 160) / 120
    windows: list[Window] = []
    H = similarity(angle_rad, zoom, 79.3, 61.8)
    view = resampled(reader(torch.stack([x, y, 0.5 * (x + y)]), windows), SIZE, H, VIEW)
    (a, b, c), (d, e, f), _ = H.tolist()
    for row in range(VIEW[0]):
        for column, (u, v) in enumerate(zip(*view[:2, row].tolist(), strict=True)):
            assert u * 160 == pytest.approx(a * column + b * row + c, abs=2e-3)
            assert v * 120 == pytest.approx(d * column + e * row + f, abs=2e-3)
    ((_, _, height, width),) = windows
    diagonal = zoom * math.hypot(*VIEW)
    assert max(height, width) <= diagonal + 12


def test_the_part_gives_what_the_whole_gives() -> None:
    image = torch.rand(3, *SIZE, generator=torch.Generator().manual_seed(0))
    H = similarity(0.4, 1.3, 60.2, 70.9) @ view_homography(VIEW, 0.0, 1.0, tilt=(0.1, -0.05))
    view = resampled(reader(image, []), SIZE, H, VIEW)
    torch.testing.assert_close(view, draw_view(image, H, VIEW), atol=1e-4, rtol=0)


@pytest.mark.parametrize("zoom", [2.0, 3.0, 3.7])
def test_shrinking_leaves_no_aliases(zoom: float) -> None:
    """A board of single pixels becomes grey; without averaging first its view would be full of stripes."""
    board = ((torch.arange(160) + torch.arange(120)[:, None]) % 2).float().expand(3, -1, -1)
    view = resampled(reader(board, []), SIZE, similarity(0.0, zoom, 80.0, 60.0), VIEW)
    assert view.mean().item() == pytest.approx(0.5, abs=0.01)
    assert view.std() < 0.1


def test_a_view_beside_the_image_is_refused() -> None:
    with pytest.raises(ValueError, match="beyond the image"):
        resampled(reader(torch.zeros(3, *SIZE), []), SIZE, similarity(0.0, 1.0, 500.0, 60.0), VIEW)


def test_worlds_are_rendered_and_other_maps_resampled() -> None:
    (world,) = world_maps(1, 1, (60, 80))
    picture = world.picture()
    plain = GeoMap("plain", world.georeference, reader(picture, []), "")
    H = similarity(0.0, 0.5, 40.0, 30.0)
    rendered, seen = map_view(world, H, VIEW), map_view(plain, H, VIEW)
    assert torch.equal(rendered, world.view(H, VIEW))
    assert not torch.equal(rendered, seen)
    # Twice the detail in the one, the same place in both.
    assert (rendered - seen).abs().mean() < 0.5 * (rendered - seen.flip(2)).abs().mean()
