"""Pixels of maps by window: whole pictures, and TIFFs from the file."""

import builtins
import hashlib
import pickle
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from diffnav.data.maps import pixels as pixels_file
from diffnav.data.maps.pixels import image_size, picture_pixels
from diffnav.data.maps.raster import map_pixels, raster_pixels
from diffnav.errors import UserError
from diffnav.images import ImageError, read_image

LEVELS = np.random.default_rng(3).integers(0, 256, (24, 40, 3), dtype=np.uint8)


def saved(path: Path, levels: np.ndarray = LEVELS, orientation: int = 1) -> Path:
    exif = Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(levels).save(path, exif=exif)
    return path


def test_windows_are_parts_of_the_picture(tmp_path):
    path = saved(tmp_path / "map.png")
    found = picture_pixels(path)
    assert found.size == (24, 40)
    assert found.fingerprint == hashlib.sha256(path.read_bytes()).hexdigest()
    expected = torch.from_numpy(LEVELS[5:9, 30:40]).permute(2, 0, 1) / 255
    torch.testing.assert_close(found.read((5, 30, 4, 10)), expected, rtol=0, atol=1e-7)
    assert found.read((0, 0, 24, 40)).shape == (3, 24, 40)
    for window in ((0, 0, 25, 40), (-1, 0, 5, 5), (0, 36, 5, 5), (0, 0, 0, 5)):
        with pytest.raises(ValueError, match="leaves its map"):
            found.read(window)


@pytest.mark.parametrize("kind", ["jpg", "png", "tif", "webp"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_the_size_is_that_of_the_upright_picture(tmp_path, kind, orientation):
    path = saved(tmp_path / f"map.{kind}", orientation=orientation)
    assert image_size(path) == read_image(path).shape[1:]
    found = picture_pixels(path)
    torch.testing.assert_close(found.read((0, 0, *found.size)), read_image(path), rtol=0, atol=1e-6)


def test_decoded_once_and_only_when_read(tmp_path, monkeypatch):
    decoded = []
    monkeypatch.setattr(pixels_file, "read_image", lambda path: decoded.append(path.name) or read_image(path))
    maps = [
        picture_pixels(saved(tmp_path / f"{name}.png", LEVELS // (number + 1))) for number, name in enumerate("abc")
    ]
    assert decoded == []
    for found in (maps[0], maps[0], maps[1], maps[0], maps[1]):
        found.read((0, 0, 2, 2))
    assert decoded == ["a.png", "b.png"]
    maps[2].read((0, 0, 2, 2))
    assert pixels_file._decoded.cache_info().currsize <= 2


def test_a_file_that_changes_is_noticed(tmp_path):
    found = picture_pixels(saved(tmp_path / "map.png"))
    saved(tmp_path / "map.png", LEVELS[:20])
    with pytest.raises(ImageError, match="has changed since"):
        found.read((0, 0, 2, 2))


def test_what_cannot_be_read(tmp_path):
    (tmp_path / "text.jpg").write_text("no picture")
    whole = saved(tmp_path / "whole.png").read_bytes()
    (tmp_path / "cut.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ImageError, match=r"text\.jpg: not an image"):
        picture_pixels(tmp_path / "text.jpg")
    with pytest.raises(ImageError, match=r"gone\.png: no such file"):
        picture_pixels(tmp_path / "gone.png")
    # The header is sound: found when it is read.
    cut = picture_pixels(tmp_path / "cut.png")
    with pytest.raises(ImageError, match=r"cut\.png: damaged image"):
        cut.read((0, 0, 2, 2))


def test_readers_travel_to_workers(tmp_path):
    found = picture_pixels(saved(tmp_path / "map.png"))
    copy = pickle.loads(pickle.dumps(found))
    assert torch.equal(copy.read((1, 2, 3, 4)), found.read((1, 2, 3, 4)))


class TestRaster:
    @pytest.fixture
    def rasterio(self):
        return pytest.importorskip("rasterio")

    def write(self, rasterio, path, bands, **profile):
        bands = np.asarray(bands)
        transform = rasterio.Affine(1, 0, 5e5, 0, -1, 5e6)
        kind = {"driver": "GTiff", "count": len(bands), "height": bands.shape[1], "width": bands.shape[2]}
        options = {"dtype": bands.dtype.name, "crs": "EPSG:32632", "transform": transform, **profile}
        colours = options.pop("colours", None)
        with rasterio.open(path, "w", **kind, **options) as file:
            file.write(bands)
            if colours:
                file.colorinterp = [getattr(rasterio.enums.ColorInterp, colour) for colour in colours]
        return path

    def test_rgb_windows(self, rasterio, tmp_path):
        path = self.write(rasterio, tmp_path / "map.tif", LEVELS.transpose(2, 0, 1), photometric="RGB")
        found = map_pixels(path)
        expected = torch.from_numpy(LEVELS[3:9, 7:40]).permute(2, 0, 1) / 255
        torch.testing.assert_close(found.read((3, 7, 6, 33)), expected, rtol=0, atol=1e-7)
        assert found.read((0, 0, 1, 1)).dtype == torch.float32
        with pytest.raises(ValueError, match="leaves its map"):
            found.read((0, 0, 24, 41))
        copy = pickle.loads(pickle.dumps(found))
        assert torch.equal(copy.read((0, 0, 24, 40)), found.read((0, 0, 24, 40)))

    def test_sixteen_bit_by_its_bits(self, rasterio, tmp_path):
        values = np.array([[[0, 1023, 4095]]], np.uint16)
        for bits, options in ((16, {}), (12, {"nbits": 12})):
            found = raster_pixels(self.write(rasterio, tmp_path / f"{bits}.tif", values, **options))
            expected = torch.tensor([0, 1023, 4095]) / (2**bits - 1)
            torch.testing.assert_close(found.read((0, 0, 1, 3)), expected.expand(3, 1, 3))

    def test_grey_with_nodata_is_black_there(self, rasterio, tmp_path):
        path = self.write(rasterio, tmp_path / "map.tif", [[[7, 51], [255, 7]]], dtype="uint8", nodata=7)
        grey = raster_pixels(path).read((0, 0, 2, 2))
        torch.testing.assert_close(grey, torch.tensor([[0, 0.2], [1, 0]]).expand(3, 2, 2))

    def test_nodata_of_colour_means_all_bands(self, rasterio, tmp_path):
        bands = np.array([[[0, 0]], [[0, 51]], [[0, 102]]], np.uint8)
        path = self.write(rasterio, tmp_path / "map.tif", bands, nodata=0, photometric="RGB")
        torch.testing.assert_close(raster_pixels(path).read((0, 0, 1, 2))[:, 0, 1], torch.tensor([0, 0.2, 0.4]))

    def test_alpha_is_laid_over_black(self, rasterio, tmp_path):
        bands = np.array([[[255, 100]], [[0, 100]], [[255, 100]], [[51, 0]]], np.uint8)
        path = self.write(rasterio, tmp_path / "map.tif", bands, colours=("red", "green", "blue", "alpha"))
        torch.testing.assert_close(
            raster_pixels(path).read((0, 0, 1, 2)), torch.tensor([[[0.2, 0]], [[0, 0]], [[0.2, 0]]])
        )

    def test_bands_by_their_meaning(self, rasterio, tmp_path):
        bands = np.array([[[10]], [[20]], [[30]], [[40]]], np.uint8)
        order = ("undefined", "blue", "green", "red")
        path = self.write(rasterio, tmp_path / "map.tif", bands, colours=order, photometric="MINISBLACK")
        torch.testing.assert_close(raster_pixels(path).read((0, 0, 1, 1))[:, 0, 0] * 255, torch.tensor([40.0, 30, 20]))

    def test_palette(self, rasterio, tmp_path):
        path = self.write(rasterio, tmp_path / "map.tif", np.array([[[1, 0]]], np.uint8), photometric="PALETTE")
        with rasterio.open(path, "r+") as file:
            file.write_colormap(1, {0: (255, 0, 51, 255), 1: (0, 102, 0, 255)})
        expected = torch.tensor([[[0, 1.0]], [[0.4, 0]], [[0, 0.2]]])
        torch.testing.assert_close(raster_pixels(path).read((0, 0, 1, 2)), expected)

    def test_floating_point(self, rasterio, tmp_path):
        bands = np.array([[[0.25, np.nan, -9999]]], np.float32)
        path = self.write(rasterio, tmp_path / "map.tif", bands, nodata=-9999)
        found = raster_pixels(path)
        assert found.read((0, 0, 1, 1))[0, 0, 0] == 0.25
        assert found.read((0, 2, 1, 1)).max() == 0
        with pytest.raises(ImageError, match=r"map\.tif: values outside of 0 to 1"):
            found.read((0, 1, 1, 1))

    def test_what_cannot_be_read(self, rasterio, tmp_path):
        whole = self.write(
            rasterio, tmp_path / "whole.tif", np.tile(LEVELS.transpose(2, 0, 1), (1, 20, 20))
        ).read_bytes()
        (tmp_path / "cut.tif").write_bytes(whole[: len(whole) // 2])
        (tmp_path / "text.tif").write_text("no picture")
        for name, reason in (("text.tif", "damaged image"), ("gone.tif", "no such file")):
            with pytest.raises(ImageError, match=rf"{name}: {reason}"):
                raster_pixels(tmp_path / name)
        with pytest.raises(ImageError, match=r"cut\.tif: damaged image"):
            raster_pixels(tmp_path / "cut.tif").read((0, 0, 480, 800))
        complex_values = np.zeros((1, 2, 2), np.complex64)
        with pytest.raises(ImageError, match="values of kind complex64"):
            raster_pixels(self.write(rasterio, tmp_path / "c.tif", complex_values))

    def test_without_rasterio(self, tmp_path, monkeypatch):
        real = builtins.__import__

        def without(name, *rest):
            if name.startswith("rasterio"):
                raise ImportError(name)
            return real(name, *rest)

        path = saved(tmp_path / "map.tif")
        monkeypatch.setattr(builtins, "__import__", without)
        torch.testing.assert_close(map_pixels(path).read((0, 0, 24, 40)), read_image(path))
        with pytest.raises(UserError, match=r"map\.tif: a GeoTIFF needs rasterio: pip install 'diffnav\[geo\]'"):
            raster_pixels(path)
