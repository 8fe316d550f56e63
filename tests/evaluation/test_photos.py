import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

import diffnav.images
from diffnav.checkpoints import save_enhancer
from diffnav.enhancers.gamma_blind import GammaBlind
from diffnav.enhancers.gamma_oracle import GammaOracle
from diffnav.enhancers.input import Input
from diffnav.enhancers.normal import Normal
from diffnav.errors import UserError
from diffnav.evaluation.photos import Job, enhance_photos, plan_photos
from diffnav.images import read_image
from diffnav.retinex.enhancer import RetinexEnhancer

CPU = torch.device("cpu")
REPOSITORY = Path(__file__).parents[2]


def levels_of(height=20, width=24, seed=0):
    return np.random.default_rng(seed).integers(0, 60, (height, width, 3), dtype=np.uint8)


def put(path, levels=None, **options):
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(levels_of() if levels is None else levels).save(path, **options)
    return path


def files_below(folder):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


@pytest.fixture
def photos(tmp_path):
    """Three photographs and a text file, in a folder and its sub-folder."""
    put(tmp_path / "photos" / "a.png")
    put(tmp_path / "photos" / "sub" / "b.JPG", levels_of(33, 17, 1), format="JPEG")
    put(tmp_path / "photos" / "sub" / "c.tif", levels_of(16, 40, 2))
    (tmp_path / "photos" / "notes.txt").write_text("not a picture")
    return tmp_path / "photos"


def test_names_sizes_and_values(photos, tmp_path):
    out = tmp_path / "bright"
    outcome = enhance_photos(plan_photos(photos, out), GammaBlind(4.0), CPU)
    assert files_below(out) == ["a.png", "sub/b.JPG", "sub/c.tif"]
    assert sorted(outcome.written) == sorted(out / name for name in files_below(out))
    assert outcome.skipped == []
    assert [Image.open(out / n).size for n in files_below(out)] == [(24, 20), (17, 33), (40, 16)]
    # x^(1/4), by hand on one picture.
    expected = np.round(255 * (levels_of() / 255.0) ** 0.25)
    assert np.abs(np.asarray(Image.open(out / "a.png")).astype(int) - expected).max() <= 1


def test_one_file_instead_of_a_folder(photos, tmp_path):
    enhance_photos(plan_photos(photos / "sub" / "b.JPG", tmp_path / "bright"), Input(), CPU)
    assert files_below(tmp_path / "bright") == ["b.JPG"]


@pytest.mark.parametrize("ending", ["jpg", "png", "webp", "tif"])
def test_exif_stays_and_the_picture_stands_upright(ending, tmp_path):
    exif = Image.Exif()
    exif[0x0112], exif[0x010F], exif[0x0132] = 6, "Camera", "2024:05:06 07:08:09"
    # Orientation 6: the stored rows run from the picture's right side to its left.
    upright = np.zeros((48, 32, 3), np.uint8)
    upright[:16] = 200
    put(tmp_path / "photos" / f"p.{ending}", np.rot90(upright).copy(), exif=exif)
    enhance_photos(plan_photos(tmp_path / "photos", tmp_path / "out"), Input(), CPU)
    with Image.open(tmp_path / "out" / f"p.{ending}") as result:
        assert result.size == (32, 48)
        tags = result.getexif()
        assert np.abs(np.asarray(result.convert("RGB")).astype(int) - upright)[4:-4].mean() < 4
    assert tags.get(0x0112, 1) == 1
    assert (tags[0x010F], tags[0x0132]) == ("Camera", "2024:05:06 07:08:09")


def test_place_and_time_of_a_jpeg_stay(tmp_path):
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0x9003] = "2024:05:06 07:08:09"
    exif.get_ifd(0x8825).update({1: "N", 2: (47.0, 30.0, 0.0)})
    put(tmp_path / "photos" / "p.jpg", exif=exif)
    enhance_photos(plan_photos(tmp_path / "photos", tmp_path / "out"), Input(), CPU)
    tags = Image.open(tmp_path / "out" / "p.jpg").getexif()
    assert tags.get_ifd(0x8769)[0x9003] == "2024:05:06 07:08:09"
    assert tags.get_ifd(0x8825)[1] == "N"
    assert tags.get_ifd(0x8825)[2] == (47.0, 30.0, 0.0)


def kinds_of_tiff(folder):
    """TIFFs whose directory describes pixels quite unlike the 8-bit RGB of the results, with what they show."""
    rgb = levels_of(32, 40, 3)
    grey16 = (levels_of(32, 40, 4)[..., 0].astype(np.uint16) + 7) * 257
    shown = {"lzw": rgb, "predicted": rgb, "four": rgb, "grey16": np.repeat((grey16 // 257)[..., None], 3, 2)}
    put(folder / "lzw.tif", rgb, compression="tiff_lzw")
    put(folder / "predicted.tif", rgb, compression="tiff_adobe_deflate", tiffinfo={317: 2})
    put(folder / "four.tif", np.dstack([rgb, np.full((32, 40), 255, np.uint8)]))
    put(folder / "grey16.tif", grey16)
    return shown


def test_every_kind_of_tiff_comes_out_readable_and_as_8_bit_rgb(tmp_path):
    shown = kinds_of_tiff(tmp_path / "photos")
    outcome = enhance_photos(plan_photos(tmp_path / "photos", tmp_path / "out"), Input(), CPU)
    assert outcome.skipped == []
    for name, levels in shown.items():
        with Image.open(tmp_path / "out" / f"{name}.tif") as result:
            assert result.mode == "RGB"
            assert np.array_equal(np.asarray(result), levels), name


def test_what_cannot_be_read_is_skipped_and_named(photos, tmp_path):
    (photos / "text.png").write_text("no picture")
    whole = put(photos / "cut.jpg", levels_of(200, 200)).read_bytes()
    (photos / "cut.jpg").write_bytes(whole[: len(whole) // 2])
    put(photos / "tiny.png", levels_of(15, 40))
    (photos / "broken-link.png").symlink_to(tmp_path / "nowhere.png")
    outcome = enhance_photos(plan_photos(photos, tmp_path / "out"), Input(), CPU)
    assert files_below(tmp_path / "out") == ["a.png", "sub/b.JPG", "sub/c.tif"]
    assert [sentence.split(":")[0] for sentence in outcome.skipped] == [
        str(photos / name) for name in ("broken-link.png", "cut.jpg", "text.png", "tiny.png")
    ]
    assert "40 x 15 pixels" in outcome.skipped[-1]


def test_existing_results_are_counted_and_left_alone_until_told(photos, tmp_path):
    out = tmp_path / "out"
    put(out / "sub" / "b.JPG", format="JPEG")
    before = (out / "sub" / "b.JPG").read_bytes()
    with pytest.raises(UserError, match=r"1 of 3 results exist already, the first is .*b\.JPG.*overwrite=true"):
        plan_photos(photos, out)
    assert files_below(out) == ["sub/b.JPG"]
    assert (out / "sub" / "b.JPG").read_bytes() == before
    enhance_photos(plan_photos(photos, out, overwrite=True), Input(), CPU)
    assert (out / "sub" / "b.JPG").read_bytes() != before


@pytest.mark.parametrize("out", ["photos", "link", "photos/sub/.."])
def test_originals_are_never_replaced(photos, tmp_path, out):
    (tmp_path / "link").symlink_to(photos)
    with pytest.raises(UserError, match="originals, which would be lost"):
        plan_photos(photos, tmp_path / out, overwrite=True)


def test_an_original_met_under_another_relative_name_is_not_replaced(tmp_path):
    put(tmp_path / "p" / "raw" / "x.png")
    put(tmp_path / "p" / "raw" / "raw" / "x.png")
    with pytest.raises(UserError, match="originals, which would be lost"):
        plan_photos(tmp_path / "p" / "raw", tmp_path / "p", overwrite=True)


def test_images_inside_out_are_enhanced(tmp_path):
    put(tmp_path / "p" / "raw" / "x.png")
    jobs = plan_photos(tmp_path / "p" / "raw", tmp_path / "p")
    assert jobs == [Job(tmp_path / "p" / "raw" / "x.png", tmp_path / "p" / "x.png")]


def test_results_inside_the_folder_of_photographs_are_not_enhanced_again(photos):
    out = photos / "bright"
    first = plan_photos(photos, out)
    enhance_photos(first, Input(), CPU)
    assert plan_photos(photos, out, overwrite=True) == first
    assert files_below(out) == ["a.png", "sub/b.JPG", "sub/c.tif"]


def test_mistakes_are_one_sentence(photos, tmp_path):
    with pytest.raises(UserError, match="no folder"):
        plan_photos(tmp_path / "nothing", tmp_path / "out")
    with pytest.raises(UserError, match="is a file: give a folder"):
        plan_photos(photos, photos / "a.png")
    with pytest.raises(UserError, match="is no image"):
        plan_photos(photos / "notes.txt", tmp_path / "out")
    with pytest.raises(UserError, match="lie in out="):
        plan_photos(tmp_path, photos)


@pytest.mark.parametrize("enhancer", [GammaOracle(), Normal()])
def test_enhancers_that_need_a_record_say_so(enhancer, photos, tmp_path):
    with pytest.raises(UserError, match="needs the record"):
        enhance_photos(plan_photos(photos, tmp_path / "out"), enhancer, CPU)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("moment", ["while saving", "between photographs"])
def test_after_ctrl_c_there_are_only_whole_files(moment, photos, tmp_path, monkeypatch):
    calls = []

    def interrupted(*arguments):
        calls.append(arguments)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return replace(*arguments) if moment == "while saving" else arguments[0]

    replace = os.replace
    enhancer = torch.nn.Identity()
    if moment == "while saving":
        monkeypatch.setattr(diffnav.images.os, "replace", interrupted)
    else:
        enhancer.forward = interrupted
    with pytest.raises(KeyboardInterrupt):
        enhance_photos(plan_photos(photos, tmp_path / "out"), enhancer, CPU)
    assert files_below(tmp_path / "out") == ["a.png"]
    assert torch.equal(read_image(tmp_path / "out" / "a.png"), read_image(photos / "a.png"))


def tiny_network():
    torch.manual_seed(0)
    return RetinexEnhancer(width=4, padding="zeros").eval()


def test_bf16_gives_nearly_the_same_picture(photos, tmp_path):
    network = tiny_network()
    for name, bf16 in (("exact", False), ("fast", True)):
        enhance_photos(plan_photos(photos / "a.png", tmp_path / name), network, CPU, bf16)
    exact, fast = (read_image(tmp_path / name / "a.png") for name in ("exact", "fast"))
    assert (exact - fast).abs().max() < 0.02


def command(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "eval.photos", *arguments], cwd=REPOSITORY, capture_output=True, text=True, timeout=120
    )


def test_the_command_with_awkward_paths_and_a_checkpoint(tmp_path):
    source, out = tmp_path / "night, 1 a=b", tmp_path / "it's bright"
    low = levels_of(24, 32, 5)
    put(source / "x = 1, 'y' (2).png", low)
    (source / "bad, file.png").write_text("no picture")
    save_enhancer(tmp_path / "tiny=net.pt", tiny_network(), "joint", {})
    checkpoint = f'checkpoint="{tmp_path}/tiny=net.pt"'
    done = command(f'images="{source}"', f'out="{out}"', checkpoint, "device=cpu")
    assert done.returncode == 0, done.stderr
    assert "1 of 2 photographs enhanced" in done.stdout
    assert f"skipped: {source}/bad, file.png" in done.stderr
    assert files_below(out) == ["x = 1, 'y' (2).png"]
    with torch.no_grad():
        expected = tiny_network()(torch.from_numpy(low).permute(2, 0, 1)[None] / 255)
    result = read_image(out / "x = 1, 'y' (2).png")
    torch.testing.assert_close(result, expected[0], atol=0.51 / 255, rtol=0)


def test_the_command_when_nothing_can_be_written(tmp_path):
    (tmp_path / "bad.png").write_text("no picture")
    done = command(f'images="{tmp_path}"', f'out="{tmp_path / "out"}"', "enhancer=gamma_blind")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith("error: none of the 1 images could be enhanced")
    assert "Traceback" not in done.stderr
