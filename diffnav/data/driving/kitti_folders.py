"""KITTI's folders of cameras: image_0 and image_1 are grey, image_2 and image_3 in colour."""

from collections.abc import Sequence
from pathlib import Path

from diffnav.errors import UserError

# Colour first: what has both is asked for matches as a camera would see them.
_PAIRS = (("image_2", "image_3"), ("image_0", "image_1"))


def cameras_of(folder: Path, cameras: Sequence[str] | None, tree: str) -> tuple[str, str]:
    """The two camera folders to take: those named, or image_2 and image_3, or image_0 and image_1.

    tree: the expected folders, a sentence for the errors. Raises: UserError if one of them does not exist.
    """
    if cameras is not None and (len(cameras) != 2 or cameras[0] == cameras[1]):
        raise UserError(f"data.cameras must be two folders, of queries and of references, got {list(cameras)}")
    choices = _PAIRS if cameras is None else ((cameras[0], cameras[1]),)
    # The pair that is there in part tells best which folder is missing.
    first, second = max(choices, key=lambda pair: sum((folder / camera).is_dir() for camera in pair))
    for camera in (first, second):
        if not (folder / camera).is_dir():
            raise UserError(f"no folder {folder / camera}: {tree}")
    return first, second
