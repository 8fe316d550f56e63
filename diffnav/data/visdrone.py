"""VisDrone2018-DET as it is unpacked: VisDrone2018-DET-{train,val}/images/*.jpg, the paper's training images."""

from collections.abc import Sequence
from pathlib import Path

from diffnav.data.photos import Photo, photo_of
from diffnav.errors import UserError
from diffnav.images import find_images

TREE = "VisDrone2018-DET is folders VisDrone2018-DET-train and VisDrone2018-DET-val, each with its pictures in images"


def visdrone_photos(root: str | Path, parts: Sequence[str] = ("train",)) -> list[Photo]:
    """The pictures of these parts of VisDrone-DET; the site is the sequence, the file name's first number.

    Args:
        root: the folder that holds the parts, or one part itself (`parts` then does not matter).
        parts: train, val, or what else follows "DET-" in a folder's name; the 2019 release, of the same
            pictures, is taken too.
    Raises: UserError, describing the expected folders, if a part is missing or holds no image.
    """
    root = Path(root).expanduser()
    folders = [root] if (root / "images").is_dir() else [_part(root, part) for part in parts]
    if not folders:
        raise UserError("data.photos.parts names no part; give train, val or both")
    return [
        photo_of(path, root, site=path.stem.split("_")[0])
        for folder in folders
        for path in find_images(folder / "images")
    ]


def _part(root: Path, part: str) -> Path:
    found = [folder for folder in sorted(root.glob(f"VisDrone20??-DET-{part}")) if (folder / "images").is_dir()]
    if not found:
        raise UserError(f"no folder {root / f'VisDrone2018-DET-{part}' / 'images'}: {TREE}; give their parent")
    return found[0]
