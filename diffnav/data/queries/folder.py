"""Queries in a folder of plain photos."""

import re
from pathlib import Path
from typing import Any, cast

from diffnav.data.photos import Photo, folder_photos, photo_of
from diffnav.data.queries.query import Query
from diffnav.data.queries.truth import read_truth
from diffnav.data.queries.truth_table import Columns
from diffnav.errors import UserError
from diffnav.images import IMAGE_SUFFIXES


def folder_queries(
    path: str | Path, truth: str | Path = "auto", columns: Columns | None = None
) -> tuple[list[Query], list[str]]:
    """(every photo below a folder, or the one photo, as a query; problems with their truth as sentences).

    The order is that of the file names, numbers in them counted as numbers; a flight is a sub-folder, or the names
    that differ in their number alone. Nothing is decoded. truth, columns: as in `read_truth`.
    Raises: UserError if there is no photo, or for a truth table that cannot be used.
    """
    path = Path(path).expanduser()
    photos = sorted(_photos(path), key=lambda photo: _natural(photo.name))
    root = path if path.is_dir() else path.parent
    files = {photo.name: cast(Path, photo.normal) for photo in photos}
    truths, problems = read_truth(files, truth, columns, root)
    queries = []
    for photo in photos:
        known = truths[photo.name]
        queries.append(
            Query(
                name=photo.name,
                image=files[photo.name],
                truth=known.place,
                heading_deg=known.heading_deg,
                height_m=known.height_m,
                ground_sample_distance_m=known.ground_sample_distance_m,
                time=known.time,
                flight=photo.site,
            )
        )
    return queries, problems


def _photos(path: Path) -> list[Photo]:
    if not path.is_file():
        return folder_photos(path)
    if path.suffix.lower() not in IMAGE_SUFFIXES:
        raise UserError(f"{path}: no photo; give an image or a folder of images")
    return [photo_of(path, path.parent)]


def _natural(name: str) -> list[Any]:
    """A key by which photo 9 stands before photo 10."""
    return [int(part) if part.isdigit() else part for part in re.split(r"([0-9]+)", name)]
