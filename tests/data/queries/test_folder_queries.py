"""Folders of photos as queries."""

from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from diffnav.data.queries.folder import folder_queries
from diffnav.errors import UserError


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for level, name in enumerate(("DJI_10.png", "DJI_9.png", "north/1.png", "north/2.png")):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        Image.fromarray(np.full((4, 6, 3), 51 * level, np.uint8)).save(tmp_path / name)
    return tmp_path


def test_order_flights_and_facts(folder):
    (folder / "photo_metadata.csv").write_text(
        "Filename,Latitude,Longitude,Altitude,Gimball_Yaw\nDJI_9.png,60.5,22.5,+100.0,-90\nnorth/2.png,60.6,22.6,+90,0\n"
    )
    queries, problems = folder_queries(folder)
    assert [query.name for query in queries] == ["DJI_9", "DJI_10", "north/1", "north/2"]
    assert [query.flight for query in queries] == ["DJI", "DJI", "north", "north"]
    assert [query.truth for query in queries] == [(60.5, 22.5), None, None, (60.6, 22.6)]
    first = queries[0]
    assert (first.heading_deg, first.height_m, first.time, first.on_map) == (270, 100, None, True)
    assert problems == ["2 of 4 photos have no truth (EXIF holds no GPS position), the first is DJI_10"]
    torch.testing.assert_close(first.read(), torch.full((3, 4, 6), 0.2))


def test_without_truth_nothing_is_missing(folder):
    queries, problems = folder_queries(str(folder), "none")
    assert len(queries) == 4
    assert problems == []


def test_one_photo(folder):
    (query,), _ = folder_queries(folder / "DJI_9.png", "none")
    assert (query.name, query.flight) == ("DJI_9", "DJI")


def test_stated_columns(folder):
    (folder / "t.txt").write_text("22.5 60.5 DJI_9.png\n")
    queries, _ = folder_queries(folder, folder / "t.txt", {"name": 3, "latitude": 2, "longitude": 1})
    assert queries[0].truth == (60.5, 22.5)


def test_damaged_photos_do_not_end_the_batch(folder):
    (folder / "DJI_1.png").write_text("no picture")
    queries, problems = folder_queries(folder)
    assert queries[0].name == "DJI_1"
    assert "DJI_1: no truth (tags cannot be read)" in problems


def test_mistakes_are_one_sentence(folder):
    (folder / "t.txt").write_text("")
    (folder / "empty").mkdir()
    for name, reason in (("gone", "no folder"), ("t.txt", "no photo; give an image"), ("empty", "no images in")):
        with pytest.raises(UserError, match=reason):
            folder_queries(folder / name)
