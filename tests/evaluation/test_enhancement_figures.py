"""Which photos and which part of them the figures show."""

from pathlib import Path

import pytest
import torch

from diffnav.data.photos import Photo
from diffnav.errors import UserError
from diffnav.evaluation.enhancement_figures import choose_photos
from diffnav.evaluation.figures import busiest_window

PHOTOS = [Photo(f"{site}{i}", site, Path("x")) for site, count in (("a", 3), ("b", 1), ("c", 2)) for i in range(count)]


@pytest.mark.parametrize(
    ("count", "sites", "expected"),
    [
        (0, None, []),
        (2, None, ["a0", "b0"]),
        (5, None, ["a0", "b0", "c0", "a1", "c1"]),
        (99, None, ["a0", "b0", "c0", "a1", "c1", "a2"]),
        (2, ["c"], ["c0", "c1"]),
    ],
)
def test_photos_of_as_many_sources_as_possible(count: int, sites: list[str] | None, expected: list[str]) -> None:
    assert [photo.name for photo in choose_photos(PHOTOS, count, sites)] == expected


def test_unknown_sources_are_named() -> None:
    with pytest.raises(UserError, match="there are a, b, c"):
        choose_photos(PHOTOS, 2, ["z"])


def test_the_busiest_window_holds_the_texture() -> None:
    image = torch.full((3, 80, 120), 0.5)
    image[:, 40:60, 90:120] = torch.rand(3, 20, 30, generator=torch.Generator().manual_seed(0))
    top, left, height, width = busiest_window(image)
    assert (height, width) == (20, 30)
    assert abs(top - 40) <= 5
    assert abs(left - 90) <= 5
    assert top + height <= 80
    assert left + width <= 120
