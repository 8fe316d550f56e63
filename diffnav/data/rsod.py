"""RSOD as it is unpacked: four folders in PASCAL VOC style, the set that the paper's test images are drawn from."""

from collections.abc import Sequence
from pathlib import Path

from diffnav.data.photos import Photo, photo_of
from diffnav.errors import UserError
from diffnav.images import find_images

CLASSES = ("aircraft", "playground", "overpass", "oiltank")


def rsod_photos(root: str | Path, classes: Sequence[str] = CLASSES) -> list[Photo]:
    """The pictures in ROOT/CLASS/JPEGImages of these classes, class by class; the site is the class.

    Raises: UserError, describing the expected folders, if one is missing or holds no image.
    """
    root = Path(root).expanduser()
    folders = {name: root / name / "JPEGImages" for name in classes}
    for folder in folders.values():
        if not folder.is_dir():
            raise UserError(
                f"no folder {folder}: RSOD is folders {', '.join(CLASSES)}, each with its pictures in JPEGImages; "
                "give their parent, or name those you have in data.photos.classes"
            )
    if not folders:
        raise UserError(f"data.photos.classes names no class; give some of {', '.join(CLASSES)}")
    return [photo_of(path, root, site=name) for name, folder in folders.items() for path in find_images(folder)]
