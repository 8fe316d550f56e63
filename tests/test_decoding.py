"""Reading every kind of file that a folder of photographs may hold."""

import contextlib
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import ExifTags, Image

from diffnav.images import ImageError, read_exif, read_image

HEIGHT, WIDTH = 6, 10


@pytest.fixture
def levels() -> np.ndarray:
    return np.random.default_rng(0).integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)


@pytest.fixture
def deep() -> np.ndarray:
    return np.random.default_rng(1).integers(0, 65536, (HEIGHT, WIDTH, 3)).astype(np.uint16)


def as_array(path: Path) -> np.ndarray:
    """(H, W, 3) of what `read_image` returns, after the checks that hold for every file."""
    image = read_image(path)
    assert image.dtype == torch.float32 and image.is_contiguous()  # noqa: PT018
    assert 0 <= image.min() <= image.max() <= 1
    return image.permute(1, 2, 0).numpy()


def write_tiff16(path: Path, values: np.ndarray, orientation: int = 1) -> None:
    """A plain little-endian TIFF of (H, W, C) 16-bit values, byte for byte after the TIFF 6.0 specification."""
    height, width, channels = values.shape
    pixels = values.astype("<u2").tobytes()
    bits = struct.pack(f"<{channels}H", *[16] * channels).ljust(8, b"\0")
    tags = [(256, width), (257, height), (258, 8 + len(pixels)), (259, 1), (262, 2), (273, 8)]
    tags += [(274, orientation), (277, channels), (278, height), (279, len(pixels)), (284, 1)]
    entries = [
        struct.pack("<HHII", tag, 3 if tag == 258 else 4, channels if tag == 258 else 1, value) for tag, value in tags
    ]
    head = struct.pack("<2sHI", b"II", 42, 8 + len(pixels) + len(bits))
    path.write_bytes(head + pixels + bits + struct.pack("<H", len(tags)) + b"".join(entries) + b"\0" * 4)


@pytest.mark.parametrize("ending", ["png", "bmp", "tif", "tiff", "ppm", "PNG"])
def test_rgb_files_are_read_as_they_are(tmp_path, levels, ending):
    path = tmp_path / f"a.{ending}"
    Image.fromarray(levels).save(path)
    np.testing.assert_allclose(as_array(path), levels / 255, atol=1e-7)


def test_grey_becomes_three_equal_channels(tmp_path, levels):
    for name, mode in (("a.png", "L"), ("b.jpg", "L"), ("c.png", "1"), ("d.pgm", "L")):
        picture = Image.fromarray(levels).convert(mode)
        picture.save(tmp_path / name, quality=100)
        with Image.open(tmp_path / name) as stored:
            expected = np.asarray(stored.convert("L")) / 255
        for channel in np.moveaxis(as_array(tmp_path / name), 2, 0):
            np.testing.assert_allclose(channel, expected, atol=1e-7)


@pytest.mark.parametrize("ending", ["png", "tif", "pgm"])
def test_16_bit_grey_keeps_its_precision(tmp_path, deep, ending):
    path = tmp_path / f"a.{ending}"
    cv2.imwrite(str(path), deep[..., 0])
    np.testing.assert_allclose(as_array(path), np.repeat(deep[..., :1] / 65535, 3, 2), atol=1e-6)


def test_16_bit_colour_keeps_order_and_precision(tmp_path, deep):
    cv2.imwrite(str(tmp_path / "a.png"), deep[..., ::-1])
    cv2.imwrite(str(tmp_path / "b.tif"), deep[..., ::-1])
    write_tiff16(tmp_path / "c.tif", deep)
    for name in ("a.png", "b.tif", "c.tif"):
        np.testing.assert_allclose(as_array(tmp_path / name), deep / 65535, atol=1e-6, err_msg=name)


def test_16_bit_alpha_is_laid_over_black(tmp_path, deep):
    alpha = deep[..., :1] // 2
    cv2.imwrite(str(tmp_path / "a.png"), np.concatenate([deep[..., ::-1], alpha], 2))
    np.testing.assert_allclose(as_array(tmp_path / "a.png"), deep / 65535 * (alpha / 65535), atol=1e-6)


def test_tiffs_that_pillow_lacks_are_read_by_opencv(tmp_path, deep, monkeypatch):
    values = (deep / 65535).astype(np.float32)
    cv2.imwrite(str(tmp_path / "float.tif"), values[..., ::-1])
    np.testing.assert_allclose(as_array(tmp_path / "float.tif"), values, atol=1e-7)
    cv2.imwrite(str(tmp_path / "wild.tif"), 300 * values)
    with pytest.raises(ImageError, match=r"wild\.tif: values from .* expected 0 to 1"):
        read_image(tmp_path / "wild.tif")
    # Older Pillow does not know 16-bit colour TIFFs.
    write_tiff16(tmp_path / "deep.tif", deep)
    monkeypatch.setattr("PIL.TiffImagePlugin.OPEN_INFO", {})
    np.testing.assert_allclose(as_array(tmp_path / "deep.tif"), deep / 65535, atol=1e-6)


def test_floating_point_grey_must_lie_in_0_1(tmp_path):
    values = np.linspace(0, 1, 60, dtype=np.float32).reshape(6, 10)
    Image.fromarray(values).save(tmp_path / "a.tif")
    np.testing.assert_allclose(as_array(tmp_path / "a.tif")[..., 2], values, atol=1e-7)
    for name, bad in (("high", 2.0), ("low", -0.5), ("nan", np.nan), ("inf", np.inf)):
        Image.fromarray(np.where(values > 0.5, np.float32(bad), values)).save(tmp_path / f"{name}.tif")
        with pytest.raises(ImageError, match=f"{name}.tif"):
            read_image(tmp_path / f"{name}.tif")


def test_alpha_and_palettes(tmp_path, levels):
    rgba = np.dstack([levels, np.full((HEIGHT, WIDTH), 128, np.uint8)])
    Image.fromarray(rgba).save(tmp_path / "rgba.png")
    np.testing.assert_allclose(as_array(tmp_path / "rgba.png"), levels / 255 * 128 / 255, atol=1 / 255)

    palette = Image.new("P", (4, 2))
    palette.putpalette([255, 0, 0, 0, 128, 0, 10, 20, 30])
    palette.putdata([0, 1, 2, 0, 1, 1, 2, 2])
    colours = np.array([[255, 0, 0], [0, 128, 0], [10, 20, 30]])[[[0, 1, 2, 0], [1, 1, 2, 2]]]
    palette.save(tmp_path / "plain.png")
    np.testing.assert_allclose(as_array(tmp_path / "plain.png"), colours / 255, atol=1e-7)
    palette.save(tmp_path / "clear.png", transparency=1)
    colours[colours[..., 1] == 128] = 0
    np.testing.assert_allclose(as_array(tmp_path / "clear.png"), colours / 255, atol=1e-7)


def test_cmyk(tmp_path):
    inks = Image.new("CMYK", (8, 8), (255, 0, 0, 0))
    inks.paste((0, 255, 255, 128), (0, 4, 8, 8))
    inks.save(tmp_path / "a.tif")
    inks.save(tmp_path / "b.jpg", quality=100, subsampling=0)
    for name in ("a.tif", "b.jpg"):
        image = as_array(tmp_path / name)
        np.testing.assert_allclose(image[1, 1], [0, 1, 1], atol=0.02)
        np.testing.assert_allclose(image[6, 6], [0.5, 0, 0], atol=0.02)


# What the viewer sees of the stored rows [a b c / d e f], from the EXIF specification's "0th row, 0th column".
UPRIGHT = ["abc def", "cba fed", "fed cba", "def abc", "ad be cf", "da eb fc", "fc eb da", "cf be ad"]


@pytest.mark.parametrize("orientation", range(1, 9))
def test_all_exif_orientations(tmp_path, orientation):
    rows = [[ord(letter) for letter in row] for row in UPRIGHT[orientation - 1].split()]
    stored = np.repeat(np.array([[97, 98, 99], [100, 101, 102]], np.uint8)[..., None], 3, 2)
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = orientation
    for name in ("a.png", "b.tif", "c.webp", "grey.png"):
        picture = Image.fromarray(stored).convert("L" if name == "grey.png" else "RGB")
        picture.save(tmp_path / name, exif=exif, lossless=True)
        assert (as_array(tmp_path / name)[..., 1] * 255).round().tolist() == rows, name
    write_tiff16(tmp_path / "deep.tif", stored.astype(np.uint16) * 257, orientation)
    assert (as_array(tmp_path / "deep.tif")[..., 1] * 255).round().tolist() == rows


def test_damaged_exif_does_not_lose_the_picture(tmp_path, levels):
    path = tmp_path / "a.png"
    for block in (b"Exif\0\0garbage", b"Exif\0\0II*\0\x08\0\0\0\xff\xff", b"", b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01"):
        Image.fromarray(levels).save(path, exif=block)
        np.testing.assert_allclose(as_array(path), levels / 255, atol=1e-7)
        assert isinstance(read_exif(path), bytes)


@pytest.mark.parametrize("ending", ["jpg", "png", "tif", "webp", "bmp"])
@pytest.mark.parametrize("kept", [0.5, 0.95, 0.1])
def test_truncated_files_are_named(tmp_path, ending, kept):
    path = tmp_path / f"half.{ending}"
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (64, 96, 3), dtype=np.uint8)).save(path)
    path.write_bytes(path.read_bytes()[: int(kept * path.stat().st_size)])
    with pytest.raises(ImageError, match=rf"^[^\n]*half\.{ending}: [^\n]*$"):
        read_image(path)


def test_what_is_no_image_is_named(tmp_path):
    (tmp_path / "empty.jpg").touch()
    (tmp_path / "text.png").write_text("not an image, whatever its name says")
    (tmp_path / "noise.tif").write_bytes(b"II*\0" + bytes(range(256)))
    (tmp_path / "folder.png").mkdir()
    for name in ("empty.jpg", "text.png", "noise.tif", "folder.png", "missing.jpg"):
        with pytest.raises(ImageError, match=rf"^[^\n]*{name}: [^\n]+$"):
            read_image(tmp_path / name)


# Not random: a header that claims gigapixels by chance would make a run slow.
@settings(max_examples=80, deadline=None, derandomize=True)
@given(st.sampled_from(["jpg", "png", "tif", "webp", "bmp", "ppm"]), st.integers(0, 2**32 - 1))
def test_flipped_bytes_give_an_image_or_a_sentence(tmp_path_factory, ending, seed):
    """No run dies because of one file: whatever is wrong inside it, ImageError is all that is raised."""
    path = tmp_path_factory.mktemp("fuzz") / f"a.{ending}"
    dice = np.random.default_rng(seed)
    Image.fromarray(dice.integers(0, 256, (24, 20, 3), dtype=np.uint8)).save(path)
    content = np.frombuffer(path.read_bytes(), np.uint8).copy()
    content[dice.integers(0, min(len(content), 200), 4)] = dice.integers(0, 256, 4)
    path.write_bytes(content.tobytes())
    with contextlib.suppress(ImageError):
        as_array(path)
    read_exif(path)
