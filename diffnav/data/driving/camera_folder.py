"""The pictures in the folder of one camera."""

from pathlib import Path

from diffnav.data.driving.pairing import natural
from diffnav.images import IMAGE_SUFFIXES


def pictures_in(folder: Path) -> list[Path]:
    """The pictures of one folder, 9 before 10; hidden files, other kinds and sub-folders are passed over."""
    pictures = [path for path in folder.iterdir() if path.suffix.lower() in IMAGE_SUFFIXES]
    return sorted((path for path in pictures if not path.name.startswith(".")), key=lambda path: natural(path.stem))
