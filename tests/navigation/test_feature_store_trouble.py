"""Searches for features that were stopped, written in part, raced or damaged."""

from pathlib import Path

import pytest
from made_maps import picture_map
from made_noise import noise
from storing import WINDOWS, Counting, StoppedError, same, stop_at
from torch import Tensor

from diffnav.data.maps.geo_map import GeoMap, Window
from diffnav.errors import UserError
from diffnav.images import ImageError
from diffnav.navigation.feature_store import stored_features


@pytest.fixture(scope="module")
def textured() -> GeoMap:
    return picture_map(noise((140, 200), 1), "textured")


def test_a_stopped_search_goes_on_where_it_stood(textured: GeoMap, tmp_path: Path) -> None:
    whole = stored_features(textured, WINDOWS, Counting(), tmp_path / "whole")
    with pytest.raises(StoppedError):
        stored_features(textured, WINDOWS, Counting(before=stop_at(4)), tmp_path / "stopped")
    matcher = Counting()
    features = stored_features(textured, WINDOWS, matcher, tmp_path / "stopped")
    assert matcher.seen == 2
    assert same(features, whole)
    (home,) = (tmp_path / "stopped").iterdir()
    assert sorted(path.name for path in home.iterdir()) == [
        "descriptors.bin", "facts.json", "keypoints.bin", "offsets.npy", "scores.bin",
    ]  # fmt: skip


def test_what_is_half_written_is_not_used(textured: GeoMap, tmp_path: Path) -> None:
    """A search that ended while it wrote: the facts, which come last, are missing; a tile is cut off."""
    whole = stored_features(textured, WINDOWS, Counting(), tmp_path)
    (home,) = tmp_path.iterdir()
    (home / "facts.json").unlink()
    # As another file: `whole` still shows the one that was there.
    (home / "descriptors.bin").unlink()
    (home / "descriptors.bin").write_bytes(b"nonsense")
    (home / "parts").mkdir()
    (home / "parts" / "2.123.part").write_bytes(b"half of a tile")
    matcher = Counting()
    assert same(stored_features(textured, WINDOWS, matcher, tmp_path), whole)
    assert matcher.seen == 6


def test_another_process_may_end_first(textured: GeoMap, tmp_path: Path) -> None:
    """It removes the tiles that this one is about to add to."""
    other = Counting()

    def end_first(seen: int) -> None:
        if seen == 3:
            stored_features(textured, WINDOWS, other, tmp_path)

    matcher = Counting(before=end_first)
    features = stored_features(textured, WINDOWS, matcher, tmp_path)
    # Each has used what the other had found.
    assert (matcher.seen, other.seen) == (4, 3)
    assert same(features, stored_features(textured, WINDOWS, Counting(before=stop_at(0)), tmp_path))


def test_a_folder_that_cannot_be_written_is_named(textured: GeoMap, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(UserError, match=r"file.*cannot be written \(.*\); choose another cache="):
        stored_features(textured, WINDOWS, Counting(), tmp_path / "file")


def test_an_unreadable_map_is_told_as_it_is(tmp_path: Path) -> None:
    def read(_: Window) -> Tensor:
        raise ImageError("map.tif: damaged image")

    textured = picture_map(noise((140, 200), 1))
    with pytest.raises(ImageError, match=r"map\.tif: damaged image"):
        stored_features(GeoMap("broken", textured.georeference, read, "x"), WINDOWS, Counting(), tmp_path)


@pytest.mark.parametrize("damage", ["gone", "cut", "garbled"])
def test_damaged_files_are_named(textured: GeoMap, tmp_path: Path, damage: str) -> None:
    stored_features(textured, WINDOWS, Counting(), tmp_path)
    (home,) = tmp_path.iterdir()
    if damage == "gone":
        (home / "scores.bin").unlink()
    elif damage == "cut":
        (home / "descriptors.bin").write_bytes((home / "descriptors.bin").read_bytes()[:100])
    else:
        (home / "facts.json").write_text("{")
    with pytest.raises(UserError, match=f"{home.name}: does not hold what was stored there; delete the folder"):
        stored_features(textured, WINDOWS, Counting(), tmp_path)
