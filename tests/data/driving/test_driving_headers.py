"""Sizes and kinds of the pictures of pairs, told from the files' headers."""

from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from diffnav.data.driving.driving_set import Frame
from diffnav.data.driving.headers import check_sizes
from diffnav.data.driving.pairing import pair_frames
from diffnav.errors import UserError
from diffnav.images import ImageError


def save(path: Path, size: tuple[int, int], mode: str = "RGB", orientation: int | None = None) -> Frame:
    exif = Image.Exif()
    if orientation:
        exif[0x0112] = orientation
    Image.new(mode, size).save(path, exif=exif)
    return Frame(path.stem, path, path.stem.split("_")[0], "drive", path.stem.split("_")[1])


def pair(*frames: Frame):
    return pair_frames("x", frames[::2], frames[1::2], consecutive=True)


def test_grey_and_colour_may_mix_and_are_told(tmp_path: Path) -> None:
    drive = pair(
        save(tmp_path / "left_0.png", (6, 4), "L"), save(tmp_path / "right_0.png", (6, 4)),
        save(tmp_path / "left_1.png", (8, 4), "I;16"), save(tmp_path / "right_1.png", (8, 4), "L"),
    )  # fmt: skip
    assert check_sizes(drive) == [
        "grey pictures, 2 of 2 queries and 1 of 2 references, are read as three equal channels"
    ]
    assert drive.queries[0].read().shape == drive.references[0].read().shape == (3, 4, 6)


def test_sizes_within_a_pair_must_agree(tmp_path: Path) -> None:
    left, right = save(tmp_path / "left_0.png", (6, 4)), save(tmp_path / "right_0.png", (7, 4))
    with pytest.raises(ImageError, match=r"left_0\.png has 6 x 4 pixels and its partner .*right_0\.png has 7 x 4"):
        check_sizes(pair(left, right))


def test_pictures_on_their_side_count_upright(tmp_path: Path) -> None:
    turned, upright = save(tmp_path / "left_0.jpg", (4, 6), orientation=6), save(tmp_path / "right_0.jpg", (6, 4))
    assert check_sizes(pair(turned, upright)) == []
    assert turned.read().shape == upright.read().shape


def test_what_is_no_picture_is_one_sentence(tmp_path: Path) -> None:
    left, right = save(tmp_path / "left_0.png", (6, 4)), save(tmp_path / "right_0.png", (6, 4))
    (tmp_path / "right_0.png").write_text("not a picture")
    with pytest.raises(UserError, match=r"right_0\.png: not an image that can be read"):
        check_sizes(pair(left, right))
    (tmp_path / "right_0.png").unlink()
    with pytest.raises(UserError, match=r"right_0\.png: no such file"):
        check_sizes(pair(left, right))


def test_rendered_pictures_are_passed_over() -> None:
    def never() -> torch.Tensor:
        raise AssertionError("rendered")

    drive = pair(*(Frame(camera, never, camera, "drive", "0") for camera in ("left", "right")))
    assert check_sizes(drive) == []
    assert np.array_equal(drive.truth, [0])
