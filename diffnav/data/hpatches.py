"""Sequences of one scene with homographies, in the layout of Oxford (img1, H1to2p) or of HPatches (1, H_1_2)."""

import re
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from diffnav.data.photos import Photo, photo_of
from diffnav.errors import UserError
from diffnav.images import find_images

_IMAGE = re.compile(r"(img)?(\d+)")
EXPECTED = "folders with img1, img2, ... and H1to2p, ... (Oxford) or 1, 2, ... and H_1_2, ... (HPatches)"


def hpatches_photos(root: str | Path) -> list[Photo]:
    """One photo for every image but the first of every sequence below `root`; the site is the sequence.

    Raises: UserError, describing the layout, if there is none.
    """
    root = Path(root).expanduser()
    photos = [
        photo_of(path, root, site=path.parent.name)
        for path in find_images(root)
        if (number := image_number(path)) is not None and number > 1
    ]
    if not photos:
        raise UserError(f"no sequences in {root}: it should hold {EXPECTED}")
    return photos


def image_number(path: Path) -> int | None:
    """N of imgN.jpg or N.ppm; None for any other name."""
    found = _IMAGE.fullmatch(path.stem)
    return int(found.group(2)) if found else None


def first_image(path: Path) -> Path:
    """The first image of the sequence that an image belongs to. Raises: UserError if there is none."""
    firsts = [other for other in find_images(path.parent) if other.parent == path.parent and image_number(other) == 1]
    if not firsts:
        raise UserError(f"{path}: its sequence has no first image; a sequence is one of {EXPECTED}")
    return firsts[0]


def first_to_image(path: Path) -> Tensor:
    """H_first_image (3, 3) float64, from the first image of the sequence to the one in `path`.

    Raises: UserError if the file is missing, or holds no invertible matrix.
    """
    number = image_number(path)
    files = [path.parent / f"H1to{number}p", path.parent / f"H_1_{number}"]
    file = next((one for one in files if one.is_file()), None)
    if file is None:
        raise UserError(f"{path}: no homography {files[0].name} or {files[1].name} beside it")
    try:
        H = torch.from_numpy(np.array(file.read_text().split(), dtype=np.float64).reshape(3, 3))
    except ValueError:
        raise UserError(f"{file}: not a homography of nine numbers; replace it or leave the image out") from None
    if not torch.isfinite(H).all() or torch.linalg.matrix_rank(H) < 3:
        raise UserError(f"{file}: not an invertible homography; replace it or leave the image out")
    return H
