"""The photo store: every file is read once, and what cannot be used is named before training starts."""

from pathlib import Path

import numpy as np
import pytest

from diffnav.data.photos import Photo, folder_photos
from diffnav.data.store import PhotoStore
from diffnav.errors import UserError
from diffnav.images import from_uint8, write_image


def make_levels(height: int, width: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)


def save(path: Path, levels: np.ndarray) -> Path:
    write_image(path, from_uint8(levels))
    return path


def test_pictures_are_kept_in_order_as_they_are(tmp_path):
    # Each with its brightest value in another channel.
    levels = [make_levels(20, 30, seed=k) // (3 - np.eye(3, dtype=np.uint8)[k]) for k in range(3)]
    for k, picture in enumerate(levels):
        save(tmp_path / f"{k}.png", picture)
    store = PhotoStore(folder_photos(tmp_path), None, smallest=16)
    assert len(store) == 3
    assert [photo.name for photo in store.photos] == ["0", "1", "2"]
    for stored, picture in zip(store.normal, levels, strict=True):
        np.testing.assert_array_equal(stored, picture)
    assert store.low == [None, None, None]
    assert store.maximum == [picture.max() / 255 for picture in levels]
    assert store.problems == []


def test_problems_are_named_and_the_rest_is_used(tmp_path):
    save(tmp_path / "good.png", make_levels(20, 30))
    save(tmp_path / "tiny.png", make_levels(20, 15))
    (tmp_path / "empty.jpg").touch()
    (tmp_path / "text.jpg").write_text("no image")
    save(tmp_path / "half.jpg", make_levels(64, 64))
    (tmp_path / "half.jpg").write_bytes((tmp_path / "half.jpg").read_bytes()[:2000])
    (tmp_path / "notes.txt").write_text("ignored")
    photos = [*folder_photos(tmp_path), Photo("dark", "dark", None, tmp_path / "good.png")]
    store = PhotoStore(photos, None, smallest=16)
    assert [photo.name for photo in store.photos] == ["good"]
    assert len(store.normal) == len(store.low) == len(store.maximum) == 1
    named = ["empty.jpg", "half.jpg", "text.jpg", "tiny.png", "good.png"]
    assert len(store.problems) == len(named)
    for sentence, name in zip(store.problems, named, strict=True):
        assert f"{name}: " in sentence
        assert "\n" not in sentence
    assert "15 x 20 pixels, less than the 16 x 16 needed" in store.problems[3]


def test_nothing_usable_is_one_sentence(tmp_path):
    (tmp_path / "empty.jpg").touch()
    with pytest.raises(UserError, match=r"^[^\n]*empty\.jpg: [^\n]*$"):
        PhotoStore(folder_photos(tmp_path), None, smallest=16)
    (tmp_path / "none.jpg").touch()
    with pytest.raises(UserError, match=r"^none of 2 photos can be used; the first: [^\n]*empty\.jpg: [^\n]*$"):
        PhotoStore(folder_photos(tmp_path), None, smallest=16)
    with pytest.raises(UserError, match=r"^none of 0 photos can be used$"):
        PhotoStore([], None, smallest=16)


@pytest.mark.parametrize("size", [(400,), (0, 600), (400.5, 600), (400, 600, 3)])
def test_a_wrong_size_is_one_sentence(size):
    made = Photo("a", "a", lambda: from_uint8(make_levels(20, 20)))
    with pytest.raises(UserError, match=r"^data\.size must be \[height, width\] in pixels or null, got [^\n]*$"):
        PhotoStore([made], size, smallest=16)


def test_real_pairs_need_equal_sizes(tmp_path):
    day, night = save(tmp_path / "day.png", make_levels(20, 30)), save(tmp_path / "night.png", make_levels(20, 30, 1))
    turned = save(tmp_path / "turned.png", make_levels(30, 20))
    store = PhotoStore([Photo("a", "a", day, night), Photo("b", "b", day, turned)], None, smallest=16)
    assert [photo.name for photo in store.photos] == ["a"]
    np.testing.assert_array_equal(store.low[0], make_levels(20, 30, 1))
    assert store.problems == [f"{turned}: 20 x 30 pixels, its daylight picture has 30 x 20; make them equal"]


def test_sizes_are_brought_to_one(tmp_path):
    day, night = save(tmp_path / "day.png", make_levels(40, 60)), save(tmp_path / "night.png", make_levels(40, 60, 1))
    small = save(tmp_path / "small.png", make_levels(10, 12))
    store = PhotoStore([Photo("a", "a", day, night), Photo("b", "b", small)], (20, 30), smallest=16)
    assert [picture.shape for picture in store.normal] == [(20, 30, 3), (20, 30, 3)]
    # Halving by area averages 2 x 2 pixels.
    averaged = make_levels(40, 60, 1).reshape(20, 2, 30, 2, 3).mean((1, 3))
    np.testing.assert_allclose(store.low[0], averaged, atol=0.51)


def test_functions_that_make_pictures_are_named_by_their_photo():
    made = Photo("world/3", "world", lambda: from_uint8(make_levels(8, 40)))
    with pytest.raises(UserError, match=r"world/3: 40 x 8 pixels, less than the 16 x 16 needed"):
        PhotoStore([made], None, smallest=16)
