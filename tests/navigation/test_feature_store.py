"""A map's features on disk: those of the matcher, found once."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from made_maps import picture_map
from made_noise import noise
from storing import WINDOWS, Counting, same
from torch import Tensor

from diffnav.data.maps.geo_map import GeoMap
from diffnav.errors import UserError
from diffnav.matching.matches import Features
from diffnav.matching.orb_gms import OrbGms
from diffnav.matching.sift import Sift
from diffnav.matching.surf import Surf
from diffnav.navigation.feature_store import load_features, stored_features, write_features
from diffnav.navigation.tiles import tile_windows


@pytest.fixture(scope="module")
def textured() -> GeoMap:
    return picture_map(noise((140, 200), 1), "textured")


@pytest.mark.parametrize(
    ("matcher", "stored"),
    [(Sift(60), "uint8"), (OrbGms(60), "uint8"), (Surf(60), "float32")],
    ids=["sift", "orb_gms", "surf"],
)
def test_each_tile_has_the_features_that_the_matcher_finds_in_its_window(
    textured: GeoMap, tmp_path: Path, matcher: Any, stored: str
) -> None:
    features = stored_features(textured, WINDOWS, matcher, tmp_path)
    assert features.descriptors.dtype == stored
    assert isinstance(features.descriptors, np.memmap)
    for k, window in enumerate(WINDOWS):
        own, found = matcher.features(textured.read(window)), features.tile(k)
        assert len(own) > 20
        assert found.size == own.size == (100, 100)
        # Kept as pixels of the whole map, in float32.
        assert torch.allclose(found.keypoints, own.keypoints, atol=2e-5)
        assert torch.equal(found.descriptors, own.descriptors)
        assert found.descriptors.dtype == own.descriptors.dtype
        assert torch.equal(found.scores, own.scores)
        matches = matcher.match(own, found)
        assert len(matches) > 10


def test_features_are_found_once(textured: GeoMap, tmp_path: Path) -> None:
    matcher = Counting()
    first = stored_features(textured, WINDOWS, matcher, tmp_path)
    assert matcher.seen == len(WINDOWS) == 6
    assert same(stored_features(textured, WINDOWS, matcher, tmp_path), first)
    assert matcher.seen == 6


def test_other_settings_tiles_matchers_and_maps_are_found_anew(textured: GeoMap, tmp_path: Path) -> None:
    stored_features(textured, WINDOWS, Counting(), tmp_path)
    stored_features(textured, WINDOWS, Sift(40), tmp_path)
    for geo_map, windows, matcher in (
        (textured, WINDOWS, Counting(41)),
        (textured, WINDOWS[:-1], Counting()),
        (picture_map(noise((140, 200), 1), "another"), WINDOWS, Counting()),
    ):
        stored_features(geo_map, windows, matcher, tmp_path)
        assert matcher.seen == len(windows)
    assert len(list(tmp_path.iterdir())) == 5


def test_the_name_of_a_map_does_not_matter(textured: GeoMap, tmp_path: Path) -> None:
    matcher = Counting()
    stored_features(textured, WINDOWS, matcher, tmp_path)
    renamed = GeoMap("renamed", textured.georeference, textured.read, textured.fingerprint)
    assert stored_features(renamed, WINDOWS, matcher, tmp_path).map is renamed
    assert matcher.seen == 6


@pytest.mark.parametrize("matcher", [Sift(60), OrbGms(60), Surf(60)], ids=["sift", "orb_gms", "surf"])
@pytest.mark.parametrize("flat", [0, 1, 3])
def test_tiles_without_features(tmp_path: Path, matcher: Any, flat: int) -> None:
    """The first, the last, or all three tiles show one colour."""
    picture = torch.full((3, 100, 300), 0.5)
    for k in range(3):
        if flat != 3 and k != (0 if flat == 0 else 2):
            picture[..., 100 * k : 100 * k + 100] = noise((100, 100), k)
    features = stored_features(picture_map(picture), tile_windows((100, 300), (100, 100)), matcher, tmp_path)
    for k in range(3):
        own = matcher.features(picture[..., 100 * k : 100 * k + 100])
        tile = features.tile(k)
        assert len(tile) == len(own)
        assert tile.descriptors.shape == own.descriptors.shape
        assert tile.descriptors.dtype == own.descriptors.dtype
        assert len(matcher.match(own, tile)) <= len(own)
    assert (len(features.scores) == 0) == (flat == 3)


def test_a_matcher_without_keypoints_is_refused_in_a_sentence(textured: GeoMap, tmp_path: Path) -> None:
    class Dense(Counting):
        name = "loftr"

        def features(self, image: Tensor) -> Features:
            nothing = torch.zeros(0, 2)
            return Features(nothing, nothing, nothing[:, 0], (image.shape[1], image.shape[2]), image)

    with pytest.raises(UserError, match="matcher=loftr has no keypoints that could be kept for a map; use another"):
        stored_features(textured, WINDOWS, Dense(), tmp_path)


def test_tiles_are_written_one_by_one(textured: GeoMap, tmp_path: Path) -> None:
    """What is written comes back; numbers of one byte take one, whatever came before the first other."""
    alive: list[int] = []

    def tiles(last: float) -> Any:
        for k in range(3):
            alive.append(k)
            numbers = np.full((k, 4), last if k == 2 else 250.0, np.float32)
            yield {
                "keypoints": np.full((k, 2), k, np.float32),
                "descriptors": numbers,
                "scores": np.ones(k, np.float32),
            }

    for last, kind, size in ((7.0, "uint8", 12), (7.5, "float32", 48)):
        home = tmp_path / kind
        write_features(home, tiles(last))
        features = load_features(textured, WINDOWS[:3], home)
        assert features.offsets.tolist() == [0, 0, 1, 3]
        assert features.descriptors.dtype == kind
        assert (home / "descriptors.bin").stat().st_size == size
        assert features.numbers == (kind == "uint8")
        assert features.tile(2).descriptors.tolist() == [[last] * 4] * 2
        assert json.loads((home / "facts.json").read_text())["width"] == 4
    assert alive == [0, 1, 2] * 2
