"""The tiles of the scale study: where they lie, that they are found again, and how much room they need."""

import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diffnav.errors import UserError
from diffnav.evaluation.navigation import scale_maps
from diffnav.evaluation.navigation.scale_maps import ScaleMaps
from diffnav.geometry.geodesy import haversine_m
from diffnav.images import ImageError
from diffnav.matching.sift import Sift
from diffnav.navigation.faiss_index import is_binary
from diffnav.navigation.map_features import MapFeatures
from diffnav.navigation.reference import Reference


def small(cache: Path, **settings: Any) -> ScaleMaps:
    return ScaleMaps(cache, **({"tile": (64, 96), "features": 40, "indexed": 20, "pool": 4} | settings))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def database(cache: Path) -> list[MapFeatures]:
    return small(cache).database(23)


def test_nine_tiles_are_real(cache: Path, database: list[MapFeatures]) -> None:
    real, simulated = database
    assert [len(real.windows), len(simulated.windows)] == [9, 14]
    assert real.map.size == (192, 288)
    (alone,) = small(cache).database(9)
    assert (alone.descriptors == real.descriptors).all()
    found = Sift(40).features(real.map.read((64, 96, 64, 96)))
    assert real.tile(4).descriptors.tolist() == found.descriptors.tolist()


def test_the_others_lie_far_away_side_by_side(database: list[MapFeatures]) -> None:
    simulated = database[1]
    assert simulated.windows[:5] == tuple((row, column, 64, 96) for row, column in
                                          ((0, 0), (0, 96), (0, 192), (0, 288), (64, 0)))  # fmt: skip
    assert simulated.map.size == (256, 384)
    reference = Reference(database)
    distances = haversine_m(reference.places[9:], reference.places[0])
    assert distances.min() > 1_000_000
    assert reference.pixel_m == pytest.approx(0.3, rel=1e-4)
    for k, (top, left, height, width) in enumerate(simulated.windows):
        points = simulated.tile(k).keypoints.numpy() + np.array([left, top])
        assert (points >= [left, top]).all()
        assert (points < [left + width, top + height]).all()
    with pytest.raises(ImageError, match=r"simulated: there is no picture at \(0, 0, 256, 384\), only features"):
        simulated.map.picture()


def test_simulated_features_are_kept_as_sift_s_are(database: list[MapFeatures]) -> None:
    for one in database:
        assert (one.descriptors.dtype, one.numbers) == (np.uint8, True)
    assert not is_binary(database)
    assert np.diff(database[1].offsets).max() <= 40
    # 128 numbers, x, y and the score.
    assert database[1].size_bytes == int(database[1].offsets[-1]) * (128 + 12) + 15 * 8


def test_what_was_simulated_is_found_again(
    cache: Path, database: list[MapFeatures], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scale_maps, "simulated_tiles", lambda *_: pytest.fail("simulated again"))
    again = small(cache).database(23)
    assert (again[1].descriptors == database[1].descriptors).all()
    # Whatever would change them.
    for other in (small(cache, seed=1), small(cache, pool=5), small(cache, features=41), small(cache, tile=(64, 64))):
        assert other._home(14) != small(cache)._home(14)
    assert small(cache)._home(15) != small(cache)._home(14) == cache / "features" / database[1].map.fingerprint


def test_too_little_room_is_told_before(cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A tile takes 300 features of 140 bytes, and 200 of 136 in the index: 69,200; one gigabyte is to spare."""
    free = SimpleNamespace(free=int(7.9e9))
    monkeypatch.setattr(shutil, "disk_usage", lambda _: free)
    large = ScaleMaps(tmp_path / "not" / "there")
    large.require_room([9, 90_000])
    with pytest.raises(UserError, match=r"not/there: 7\.9 GB are free, 7\.9 GB are needed; choose another cache= or"):
        large.require_room([9, 100_000])
    with pytest.raises(UserError, match=r"7\.9 GB are free, 13\.5 GB are needed"):
        large.require_room([90_000, 90_000])
    free.free = 10**9
    with pytest.raises(UserError, match=r"1\.0 GB are free"):
        small(cache).require_room([24])
    small(cache).require_room([9, 23])


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"indexed": 41}, "maps.indexed must be from 1 to maps.features=40, got 41"),
        ({"indexed": 0}, "maps.indexed must be from 1 to"),
        ({"pool": 3}, "maps.pool must be 4 tiles or more, got 3"),
        ({"tile": (64,)}, r"maps.tile must be \[height, width\] in pixels, got \[64\]"),
    ],
)
def test_settings_out_of_range(tmp_path: Path, settings: dict[str, Any], sentence: str) -> None:
    with pytest.raises(UserError, match=sentence):
        small(tmp_path, **settings)


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(scale_maps, "write_features", full)
    with pytest.raises(UserError, match=r"cannot be written \(No space left on device\); choose another cache="):
        small(tmp_path).database(12)
