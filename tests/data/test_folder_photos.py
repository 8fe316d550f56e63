"""Photographs in folders: names, sites, reading."""

from pathlib import Path

import numpy as np
import pytest
import torch

from diffnav.data.photos import Photo, folder_photos, photo_of
from diffnav.errors import UserError
from diffnav.images import ImageError, from_uint8, write_image


def touch(root: Path, *names: str) -> Path:
    for name in names:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).touch()
    return root


def test_sites_are_folders_or_names_without_number(tmp_path):
    touch(tmp_path, "lewis_park_001.jpg", "lewis_park_12.jpg", "DJI-0003.JPG", "0001.png", "roof.png", "my photo 7.png")
    touch(tmp_path, "north/1.jpg", "north/2.jpg", "north/deep/x1.jpg", "notes.txt", ".hidden.jpg")
    sites = {photo.name: photo.site for photo in folder_photos(tmp_path)}
    assert sites == {
        "lewis_park_001": "lewis_park",
        "lewis_park_12": "lewis_park",
        "DJI-0003": "DJI",
        "0001": "0001",
        "roof": "roof",
        "my photo 7": "my photo",
        "north/1": "north",
        "north/2": "north",
        "north/deep/x1": "north/deep",
    }


def test_names_are_unique_though_files_differ_in_their_ending_alone(tmp_path):
    touch(tmp_path, "a.jpg", "a.png", "b.jpg", "c/a.jpg", "a.b.jpg")
    assert [photo.name for photo in folder_photos(str(tmp_path))] == ["a.b", "a.jpg", "a.png", "b", "c/a"]


def test_a_site_can_be_given(tmp_path):
    photo = photo_of(tmp_path / "x" / "1.jpg", tmp_path, site="flight")
    assert (photo.name, photo.site, photo.normal, photo.low) == ("x/1", "flight", tmp_path / "x" / "1.jpg", None)


def test_folders_without_images_are_one_sentence(tmp_path):
    touch(tmp_path, "notes.txt")
    with pytest.raises(UserError, match="no images in"):
        folder_photos(tmp_path)
    with pytest.raises(UserError, match="no folder"):
        folder_photos(tmp_path / "missing")


def test_pictures_come_from_files_or_functions(tmp_path):
    picture = from_uint8(np.random.default_rng(0).integers(0, 256, (5, 7, 3), dtype=np.uint8))
    write_image(tmp_path / "day.png", picture)
    write_image(tmp_path / "night.png", picture / 3)
    photo = Photo("a", "a", tmp_path / "day.png", tmp_path / "night.png")
    assert torch.equal(photo.read_normal(), picture)
    torch.testing.assert_close(photo.read_low(), picture / 3, atol=0.5 / 255 + 1e-6, rtol=0)
    assert torch.equal(Photo("b", "b", lambda: picture).read_normal(), picture)


def test_what_is_missing_is_named(tmp_path):
    for photo, words in (
        (Photo("a", "a", None, tmp_path / "night.png"), r"night\.png: has no daylight picture"),
        (Photo("a", "a", tmp_path / "gone.png"), r"gone\.png: no such file"),
    ):
        with pytest.raises(ImageError, match=words):
            photo.read_normal()
    with pytest.raises(ImageError, match="a: has no stored dark picture"):
        Photo("a", "a", tmp_path / "gone.png").read_low()
