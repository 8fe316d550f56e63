"""Finding, writing, quantising and resizing images."""

import os
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import ExifTags, Image

from diffnav.errors import UserError
from diffnav.images import (
    find_images,
    from_uint8,
    jpeg_round_trip,
    quantise,
    read_exif,
    read_image,
    resize,
    to_uint8,
    write_image,
)


@pytest.fixture
def picture() -> torch.Tensor:
    return torch.rand(3, 12, 20, generator=torch.Generator().manual_seed(0))


def touch(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()


def found_names(folder: Path) -> list[str]:
    return [path.relative_to(folder).as_posix() for path in find_images(folder)]


def test_find_images_takes_images_alone_in_order(tmp_path):
    images = ["b 2.JPG", "a/ü-空 1.png", "a/b/c.TIFF", "x=1,y.webp", "ß.jpeg"]
    others = ["a/notes.txt", "labels.csv", "film.mp4", "noending", ".hidden.jpg", "._b.png", "b.jpg.part"]
    touch(tmp_path, *images, *others, ".thumbnails/t.jpg", "a/.git/g.png")
    (tmp_path / "folder.png").mkdir()
    assert found_names(tmp_path) == sorted(images, key=lambda name: Path(name).parts)


def test_find_images_follows_links_once(tmp_path):
    touch(tmp_path, "disk/one.jpg", "root/two.jpg")
    (tmp_path / "root" / "link").symlink_to(tmp_path / "disk", target_is_directory=True)
    (tmp_path / "disk" / "back").symlink_to(tmp_path / "root", target_is_directory=True)
    assert found_names(tmp_path / "root") == ["link/one.jpg", "two.jpg"]


def test_a_folder_without_images_is_one_sentence(tmp_path):
    touch(tmp_path, "full/readme.txt", "full/.hidden.png", "empty/.keep")
    for name, words in (("full", "no images in"), ("empty", "no images in"), ("missing", "no folder")):
        with pytest.raises(UserError, match=f"^{words} [^\n]*{name}[^\n]*$"):
            find_images(tmp_path / name)


def test_names_with_spaces_and_unicode_round_trip(tmp_path, picture):
    path = tmp_path / "möwe über 空, =1" / "a b=c,d ü空.png"
    for image in (picture, picture[:, :1, :1]):
        write_image(path, image)
        assert torch.equal(read_image(path), quantise(image))


@pytest.mark.parametrize("ending", ["png", "bmp", "tif", "ppm", "PNG"])
def test_lossless_formats_are_exact(tmp_path, picture, ending):
    write_image(tmp_path / f"a.{ending}", picture)
    assert torch.equal(read_image(tmp_path / f"a.{ending}"), quantise(picture))


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 40), st.integers(1, 40), st.integers(0, 2**32 - 1))
def test_uint8_and_back_is_exact(height, width, seed):
    levels = np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)
    np.testing.assert_array_equal(to_uint8(from_uint8(levels)), levels)
    assert torch.equal(quantise(from_uint8(levels)), from_uint8(levels))


def test_uint8_rounds_to_nearest_and_clips():
    values = torch.tensor([-0.2, 0.0, 0.49 / 255, 0.51 / 255, 254.4 / 255, 254.6 / 255, 1.0, 1.7])
    expected = [0, 0, 0, 1, 254, 255, 255, 255]
    assert to_uint8(values.expand(3, 1, 8))[0, :, 0].tolist() == expected
    assert (quantise(values) * 255).tolist() == pytest.approx(expected)


def test_jpeg_quality_is_used(tmp_path, picture):
    small, large = tmp_path / "small.jpg", tmp_path / "large.jpg"
    write_image(small, picture, quality=30)
    write_image(large, picture, quality=98)
    assert small.stat().st_size < large.stat().st_size
    assert (read_image(large) - picture).abs().mean() < (read_image(small) - picture).abs().mean()


def test_writing_is_whole_or_not_at_all(tmp_path, picture, monkeypatch):
    path = tmp_path / "a.png"
    write_image(path, picture)
    before = path.read_bytes()

    def cut_short(self, target, **options):  # noqa: ARG001
        Path(target).write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Image.Image, "save", cut_short)
    with pytest.raises(UserError, match=r"a\.png: cannot be written \(No space left on device\)"):
        write_image(path, 1 - picture)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["a.png"]


def test_what_cannot_be_written_is_one_sentence(tmp_path, picture):
    touch(tmp_path, "file")
    for path, words in (
        (tmp_path / "a.gif", "cannot write images that end in '.gif'"),
        (tmp_path / "a", "cannot write images that end in ''"),
        (tmp_path / "file" / "a.png", "cannot be written"),
        (tmp_path / "file" / "b" / "a.png", "cannot be written"),
    ):
        with pytest.raises(UserError, match=words):
            write_image(path, picture)
    with pytest.raises(UserError, match="too long"):
        write_image(tmp_path / "a.jpg", picture, exif=b"Exif\0\0" + bytes(70_000))
    assert os.listdir(tmp_path) == ["file"]


@pytest.mark.parametrize("source", ["jpg", "png", "webp", "tif"])
@pytest.mark.parametrize("target", ["jpg", "png", "webp", "tif"])
def test_exif_is_kept_with_the_orientation_reset(tmp_path, picture, source, target):
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = 6
    exif[ExifTags.Base.Model] = "FC6310"
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.FNumber] = 2.8
    exif.get_ifd(ExifTags.IFD.GPSInfo)[ExifTags.GPS.GPSLatitude] = (47.0, 30.0, 15.0)
    Image.fromarray(to_uint8(picture)).save(tmp_path / f"in.{source}", exif=exif.tobytes())
    upright = read_image(tmp_path / f"in.{source}")
    write_image(tmp_path / f"out.{target}", upright, exif=read_exif(tmp_path / f"in.{source}"))
    assert read_image(tmp_path / f"out.{target}").shape == (3, 20, 12)
    with Image.open(tmp_path / f"out.{target}") as out:
        kept = out.getexif()
        assert kept.get(ExifTags.Base.Orientation, 1) == 1
        assert kept[ExifTags.Base.Model] == "FC6310"
        assert kept.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.FNumber] == pytest.approx(2.8)
        assert kept.get_ifd(ExifTags.IFD.GPSInfo)[ExifTags.GPS.GPSLatitude] == (47.0, 30.0, 15.0)
    if target == "jpg":
        assert not {256, 257, 273, 279} & set(kept), "a TIFF's pixel layout has no place in a JPEG"


def test_no_exif_is_empty(tmp_path, picture):
    write_image(tmp_path / "a.png", picture)
    touch(tmp_path, "empty.jpg")
    assert [read_exif(tmp_path / name) for name in ("a.png", "empty.jpg", "missing.jpg")] == [b"", b"", b""]


def test_jpeg_round_trip_is_what_a_file_would_hold(tmp_path, picture):
    levels = to_uint8(picture)
    for quality in (40, 95):
        write_image(tmp_path / "a.jpg", picture, quality)
        np.testing.assert_array_equal(jpeg_round_trip(levels, quality), to_uint8(read_image(tmp_path / "a.jpg")))
    flat = np.full((16, 16, 3), 77, np.uint8)
    np.testing.assert_array_equal(jpeg_round_trip(flat, 95), flat)


def test_area_filter_by_hand():
    row = torch.tensor([0.2, 0.6, 0.9]).expand(3, 1, 3)
    shrunk = resize(row, (1, 2))
    expected = [(0.2 + 0.3) / 1.5, (0.3 + 0.9) / 1.5]
    np.testing.assert_allclose(shrunk[0, 0], expected, atol=1e-6)
    blocks = torch.arange(16.0).reshape(1, 4, 4).expand(3, -1, -1) / 16
    np.testing.assert_allclose(resize(blocks, (2, 2))[1] * 16, [[2.5, 4.5], [10.5, 12.5]], atol=1e-5)


@pytest.mark.parametrize("size", [(10, 30), (40, 15), (12, 60), (80, 10), (21, 47)])
def test_resize_keeps_the_half_pixel_convention(size):
    """A ramp along x and y: value and place must agree by (x + 0.5) w / W - 0.5 inside the image."""
    height, width = 40, 60
    y, x = torch.meshgrid(torch.arange(height) + 0.5, torch.arange(width) + 0.5, indexing="ij")
    ramps = torch.stack([x / width, y / height, x / width])
    small = resize(ramps, size)
    assert small.shape == (3, *size)
    expected_x, expected_y = (torch.arange(size[1]) + 0.5) / size[1], (torch.arange(size[0]) + 0.5) / size[0]
    # In source pixels: the area filter is exact for whole factors, OpenCV's bicubic bends a ramp by up to .05.
    whole = height % size[0] == 0 and width % size[1] == 0
    tolerance = (1e-3 if whole else 0.15) / np.array([height, width])
    np.testing.assert_allclose(small[0, 5, 3:-3], expected_x[3:-3], atol=tolerance[1])
    np.testing.assert_allclose(small[1, 3:-3, 5], expected_y[3:-3], atol=tolerance[0])


def test_resize_to_the_same_size_changes_nothing(picture):
    assert torch.equal(resize(picture, (12, 20)), picture)


def test_shrinking_one_axis_and_growing_the_other_does_not_alias():
    stripes = (torch.arange(40) % 2).float()[:, None].expand(3, 40, 10)
    np.testing.assert_allclose(resize(stripes, (10, 20)), 0.5, atol=1e-5)
