"""Hashes change with everything that decides an answer, and with nothing else."""

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path

import pytest
import torch
from made_noise import noise
from navigation_stubs import photo_query, stub_map
from torch import Tensor

from diffnav.darkness import DarknessModel
from diffnav.data.maps.world import world_maps
from diffnav.data.photos import folder_photos
from diffnav.data.queries.camera import Camera
from diffnav.data.queries.cut import cut_queries
from diffnav.data.queries.darkened import darkened
from diffnav.data.queries.off_map import off_map_queries
from diffnav.data.queries.query import Query
from diffnav.evaluation.navigation.digests import map_digest, query_digest
from diffnav.geometry.georeference import AffineGeoreference, Degrees, LocalMetres
from diffnav.images import write_image


def test_a_photo_is_its_content_and_not_its_place_on_disk(tmp_path: Path):
    query = photo_query(tmp_path, "a")
    digest = query_digest(query)
    moved = tmp_path / "elsewhere" / "b.png"
    moved.parent.mkdir()
    moved.write_bytes(query.image.read_bytes())
    assert query_digest(replace(query, image=moved)) == digest
    write_image(query.image, noise((48, 64), 1))
    assert query_digest(query) != digest
    query.image.unlink()
    assert query_digest(query) not in (digest, query_digest(replace(query, image=moved)))


@pytest.mark.parametrize(
    "change",
    [
        {"name": "other"},
        {"truth": (47.0, 8.000001)},
        {"truth": None},
        {"on_map": False},
        {"heading_deg": 1.0},
        {"ground_sample_distance_m": 0.3},
        {"time": datetime(2020, 1, 1)},
        {"flight": "second"},
    ],
)
def test_what_is_known_of_a_photo_counts(change: dict, tmp_path: Path):
    query = photo_query(tmp_path, "a")
    assert query_digest(replace(query, **change)) != query_digest(query)
    night = darkened(query)
    assert query_digest(replace(night, **change)) != query_digest(night)


def test_how_a_photo_is_darkened_counts(tmp_path: Path):
    query = photo_query(tmp_path, "a")
    digests = {
        query_digest(one)
        for one in (
            query,
            darkened(query),
            darkened(query, seed=1),
            darkened(query, DarknessModel(gamma=(3, 4))),
            darkened(query, dark=False),
        )
    }
    assert len(digests) == 5
    assert query_digest(darkened(query)) == query_digest(darkened(query))


def cut(**settings) -> Query:
    maps = world_maps(0, 1, settings.pop("map_size", (600, 900)), cache=settings.pop("cache", None))
    return cut_queries(maps, 1, **({"size": (64, 96)} | settings))[0]


@pytest.mark.parametrize(
    "settings",
    [
        {"seed": 1},
        {"size": (64, 97)},
        {"heading_deg": 90.0},
        {"scale": (0.5, 0.6)},
        {"tilt": 0.1},
        {"camera": Camera(noise=(0.1, 0.1))},
        {"camera": Camera(quality=50)},
        {"dark": 1.0},
        {"darkness": DarknessModel(gamma=(2, 2))},
        {"map_size": (600, 1000)},
    ],
)
def test_what_a_made_picture_is_drawn_from_counts(settings: dict):
    assert query_digest(cut(**settings)) != query_digest(cut())


def test_equal_made_pictures_have_one_digest(tmp_path: Path):
    assert query_digest(cut()) == query_digest(cut())
    # Where the map is kept, and how many others are asked, decides nothing.
    assert query_digest(cut(cache=tmp_path)) == query_digest(cut())
    maps = world_maps(0, 2, (600, 900))
    more = cut_queries(maps, 3, size=(64, 96))
    assert query_digest(more[0]) == query_digest(cut())
    assert len({query_digest(query) for query in more}) == 6


def test_pictures_off_the_map(tmp_path: Path):
    first, second = off_map_queries(2, size=(64, 96))
    assert query_digest(first) == query_digest(off_map_queries(1, size=(64, 96))[0])
    assert query_digest(first) != query_digest(second)
    write_image(tmp_path / "a.png", noise((80, 120), 0))
    (photo,) = off_map_queries(1, photos=folder_photos(tmp_path), size=(64, 96))
    before = query_digest(photo)
    assert before == query_digest(off_map_queries(1, photos=folder_photos(tmp_path), size=(64, 96))[0])
    write_image(tmp_path / "a.png", noise((80, 120), 1))
    assert query_digest(photo) != before


def painted(level: float) -> Tensor:
    return torch.full((3, 40, 40), level)


def scaled(make: Callable[[], Tensor], factor: float) -> Tensor:
    return factor * make()


def test_functions_and_what_they_hold():
    names = [partial(painted, 0.5), partial(painted, 0.6), partial(painted, level=0.5)]
    names += [partial(scaled, partial(painted, 0.5), 1.0), partial(scaled, partial(painted, 0.6), 1.0)]
    assert len({query_digest(Query("q", image)) for image in names}) == 5
    assert query_digest(Query("q", partial(painted, 0.5))) == query_digest(Query("q", partial(painted, 0.5)))

    # Nobody can see into these: they are never the same.
    dark, bright = (lambda: torch.zeros(3, 40, 40)), (lambda: torch.ones(3, 40, 40))
    assert query_digest(Query("q", dark)) != query_digest(Query("q", bright))


def test_a_map_is_its_content_its_name_and_its_place():
    found = stub_map()
    other_place = AffineGeoreference((60, 80), LocalMetres((47.0, 8.0)), (0.5, 0.0, 0.1, 0.0, -0.5, 0.0))
    other_plane = AffineGeoreference((60, 80), Degrees(), (1e-5, 0.0, 8.0, 0.0, -1e-5, 47.0))
    digests = {
        map_digest(one)
        for one in (
            found,
            stub_map("other"),
            stub_map(fingerprint="changed"),
            replace(found, georeference=other_place),
            replace(found, georeference=other_plane),
        )
    }
    assert len(digests) == 5
    assert map_digest(stub_map()) == map_digest(found)


def test_maps_of_the_embedded_world(tmp_path: Path):
    first, second = world_maps(0, 2, (400, 600))
    assert map_digest(first) != map_digest(second)
    assert map_digest(world_maps(0, 1, (400, 600), cache=tmp_path)[0]) == map_digest(first)
    assert map_digest(world_maps(1, 1, (400, 600))[0]) != map_digest(first)
