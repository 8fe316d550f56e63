"""Sets of queries: photos, or pictures cut from maps, each with those that no map shows."""

from pathlib import Path

import pytest
import torch
from ramp_maps import PURE, SIZE, degrees_map

from diffnav.darkness import DarknessModel
from diffnav.data.queries.darkened import DarkenedQuery
from diffnav.data.queries.sets import cut_set, photo_set
from diffnav.errors import UserError
from diffnav.images import write_image

DARKNESS = DarknessModel(gamma=(4, 4), quality=(0, 0))


@pytest.fixture
def photos(tmp_path: Path) -> Path:
    """Four photos, of which a table places a and c on the map and b beside it."""
    for name in "abcd":
        write_image(tmp_path / f"{name}.png", torch.rand(3, 40, 50, generator=torch.Generator().manual_seed(ord(name))))
    rows = ["a.png,59.9999,24.0005", "b.png,59.9999,25", "c.png,59.99995,24.001"]
    (tmp_path / "truth.csv").write_text("\n".join(["filename,latitude,longitude", *rows]) + "\n")
    return tmp_path


def test_photos_as_they_are(photos: Path):
    found = photo_set([degrees_map()], DARKNESS, 0, photos)
    assert [query.name for query in found.queries] == list("abcd")
    assert [query.truth for query in found.queries][::2] == [(59.9999, 24.0005), (59.99995, 24.001)]
    assert all(query.on_map and not isinstance(query, DarkenedQuery) for query in found.queries)


def test_a_truth_that_no_map_shows_is_told(photos: Path):
    here, away = degrees_map(), photo_set([degrees_map()], DARKNESS, 0, photos, on_map=False)
    (note,) = [line for line in photo_set([here], DARKNESS, 0, photos).problems if "no map" in line]
    assert note == (
        "the truth of 1 of 3 photos lies on no map, the first is b; if that is right, ask them apart with "
        "query_set.on_map=false"
    )
    assert [query.on_map for query in away.queries] == [False] * 4
    assert not any("no map" in line for line in away.problems)
    # Nobody knows where these are.
    assert photo_set([here], DARKNESS, 0, photos, truth="none").problems == []


def test_photos_with_a_dark_picture(photos: Path):
    found = photo_set([degrees_map()], DARKNESS, 5, photos, darken=True)
    assert [query.dark for query in found.queries] == [False, True, False, True]
    day, dark, record = found.queries[0].read_both()
    assert record.gamma == 4
    # Eq. 9 on 8 bit.
    expected = (255 * record.A * day**4).round() / 255
    assert (dark - expected).abs().max() < 1.5 / 255
    assert [query.dark for query in photo_set([], DARKNESS, 5, photos, "none", darken=True, dark=1.0).queries] == [
        True
    ] * 4
    again = photo_set([degrees_map()], DARKNESS, 5, photos / "c.png", darken=True).queries[0]
    # What is drawn follows from the seed and the name, not from its company.
    assert (
        again.seed == found.queries[2].seed != photo_set([], DARKNESS, 6, photos, "none", darken=True).queries[2].seed
    )


def test_cut_pictures_come_map_by_map_and_then_others():
    maps = [degrees_map("one"), degrees_map("two")]
    found = cut_set(maps, DARKNESS, 0, per_map=4, off_map=3, size=SIZE, dark=0.25, camera=PURE)
    assert [query.map for query in found.queries[:8]] == ["one"] * 4 + ["two"] * 4
    assert [query.on_map for query in found.queries] == [True] * 8 + [False] * 3
    assert [query.truth is None for query in found.queries] == [False] * 8 + [True] * 3
    assert sum(query.dark for query in found.queries[:4]) == sum(query.dark for query in found.queries[4:8]) == 1
    # Those of elsewhere are taken at the maps' scale: .5 m by .3 m.
    assert {round(query.ground_sample_distance_m, 2) for query in found.queries[8:]} == {0.39}
    assert found.problems == []
    assert [query.on_map for query in cut_set(maps, DARKNESS, 0, per_map=0, off_map=2, size=SIZE).queries] == [
        False
    ] * 2


def test_photos_of_elsewhere(photos: Path):
    found = cut_set([degrees_map()], DARKNESS, 0, per_map=0, off_map=5, off_map_photos=photos, size=SIZE, camera=PURE)
    # In turn.
    assert [query.name.rpartition("_")[2] for query in found.queries] == ["a", "b", "c", "d", "a"]
    assert found.queries[0].read_day().shape == (3, *SIZE)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda _: photo_set([], DARKNESS, 0, None), "queries is missing: name a folder of photos"),
        (lambda _: photo_set([], DARKNESS, 0, ["a", "b"]), r"queries must be one folder of photos, .* \['a', 'b'\]"),
        (lambda folder: photo_set([], DARKNESS, 0, folder / "gone"), "no folder .*gone"),
        (lambda folder: photo_set([], DARKNESS, 0, folder, "none", darken=True, dark=2), "share from 0 to 1, got 2"),
        (lambda _: cut_set([degrees_map()], DARKNESS, 0, per_map=0), "per_map and query_set.off_map are both 0"),
        (lambda folder: cut_set([degrees_map()], DARKNESS, 0, 0, 1, folder / "gone"), "no folder .*gone"),
    ],
)
def test_mistakes(make, message: str, photos: Path):
    with pytest.raises(UserError, match=message):
        make(photos)
