"""Do the pictures of each pair fit together? Read from the files' headers, before anything long begins."""

from pathlib import Path

from PIL import Image

from diffnav.data.driving.driving_set import DrivingSet
from diffnav.decoding import MAX_PIXELS, ORIENTATION_TAG
from diffnav.images import ImageError

_GREY = frozenset({"1", "L", "LA", "La", "I", "F", "I;16", "I;16B", "I;16L", "I;16N"})
_TURNED = frozenset({5, 6, 7, 8})


def check_sizes(drive: DrivingSet) -> list[str]:
    """What the protocol should say of the pictures: a sentence where some of them are grey, else none.

    Pictures that are rendered are passed over; a truncated file shows when it is read.
    Raises: ImageError if a header cannot be read, or the two pictures of a pair differ in size.
    """
    grey = {"queries": 0, "references": 0}
    for query, place in zip(drive.queries, drive.truth, strict=True):
        sizes: list[tuple[int, int]] = []
        reference = drive.references[place]
        for side, frame in (("queries", query), ("references", reference)):
            if isinstance(frame.picture, Path):
                size, is_grey = _header(frame.picture)
                sizes.append(size)
                grey[side] += is_grey
        if len(set(sizes)) > 1:
            (w, h), (other_w, other_h) = sizes
            raise ImageError(
                f"{query.picture} has {w} x {h} pixels and its partner {reference.picture} has {other_w} x {other_h}; "
                "give the pictures of a pair one size"
            )
    if not any(grey.values()):
        return []
    pairs = len(drive)
    return [
        f"grey pictures, {grey['queries']} of {pairs} queries and {grey['references']} of {pairs} references, are "
        "read as three equal channels"
    ]


def _header(path: Path) -> tuple[tuple[int, int], bool]:
    """((w, h) upright, whether grey) of a picture."""
    Image.MAX_IMAGE_PIXELS = MAX_PIXELS
    try:
        with Image.open(path) as picture:
            w, h = picture.size
            turned = picture.getexif().get(ORIENTATION_TAG, 1) in _TURNED
            return (h, w) if turned else (w, h), picture.mode in _GREY
    except FileNotFoundError:
        raise ImageError(f"{path}: no such file") from None
    except Exception:  # each format's reader fails in its own way
        raise ImageError(f"{path}: not an image that can be read; remove it or save it again") from None
