"""The truth of photos to be located: from a table, from the tables beside them or their EXIF, or none."""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

from diffnav.data.coordinate_tables import TABLE_SUFFIXES
from diffnav.data.queries.exif import exif_truth
from diffnav.data.queries.facts import Truth
from diffnav.data.queries.truth_table import Columns, is_truth_table, table_truth
from diffnav.errors import UserError

__all__ = ["Truth", "read_truth"]

_USUAL_NAME = "photo_metadata.csv"


def read_truth(
    photos: Mapping[str, Path], truth: str | Path = "auto", columns: Columns | None = None, root: Path | None = None
) -> tuple[dict[str, Truth], list[str]]:
    """(what is known of every photo, problems as sentences).

    Args:
        photos: name -> file.
        truth: `auto`, the table in the photo's folder or the nearest one above it up to `root` (photo_metadata.csv,
            else the one CSV or TXT with columns for name, latitude and longitude), and EXIF for photos that it does
            not name; `none`, no places; else a table's file, which alone gives places.
        columns: which of its columns hold what (`table_truth`); None recognises them.
        root: the photos' own folder only, if None.
    Returns: one entry a photo, without a place where none is found; heading, height and time that a table lacks come
        from EXIF. Photos without a place are counted in one sentence for each reason, unless truth is `none`.
    Raises: UserError for a table that cannot be used (`table_truth`), or one given that names none of the photos.
    """
    own = {name: exif_truth(file) for name, file in photos.items()}
    if columns is not None and str(truth) in ("auto", "none"):
        raise UserError(f"columns belong to a table: set truth to its file, not to {truth}")
    if str(truth) == "none":
        return {name: facts.without_place() for name, (facts, _) in own.items()}, []
    if str(truth) == "auto":
        found, problems = _beside(photos, root)
    else:
        found, problems = _given(Path(truth).expanduser(), photos, columns)
    truths: dict[str, Truth] = {}
    placeless: dict[str, list[str]] = defaultdict(list)
    for name, (facts, reason) in own.items():
        if str(truth) != "auto":
            facts, reason = facts.without_place(), f"{truth} does not name it with a place"
        truths[name] = found[name].completed(facts) if name in found else facts
        if truths[name].place is None:
            placeless[str(reason)].append(name)
    return truths, problems + [_counted(names, reason, len(photos)) for reason, names in placeless.items()]


def _given(path: Path, photos: Mapping[str, Path], columns: Columns | None) -> tuple[dict[str, Truth], list[str]]:
    if not path.is_file():
        raise UserError(f"no file {path}: truth is auto, none, or a table of names, latitudes and longitudes")
    found, problems = table_truth(path, photos, columns)
    if not found:
        first = f"; the first problem: {problems[0]}" if problems else ""
        raise UserError(f"{path}: gives no place for any of the {len(photos)} photos{first}")
    return found, problems


def _beside(photos: Mapping[str, Path], root: Path | None) -> tuple[dict[str, Truth], list[str]]:
    """The truth in the tables that lie beside the photos."""
    of_table: dict[Path, dict[str, Path]] = defaultdict(dict)
    known: dict[Path, Path | None] = {}
    for name, file in photos.items():
        for folder in file.parents:
            if folder not in known:
                known[folder] = _table_in(folder)
            table = known[folder]
            if table is not None:
                of_table[table][name] = file
                break
            if root is None or folder == root or not folder.is_relative_to(root):
                break
    truths: dict[str, Truth] = {}
    problems: list[str] = []
    for table, named in of_table.items():
        found, faults = table_truth(table, named)
        truths.update(found)
        problems += faults
    return truths, problems


def _table_in(folder: Path) -> Path | None:
    """The table of truth in a folder. Raises: UserError if there are several and none has the usual name."""
    files = sorted(file for file in folder.iterdir() if file.suffix.lower() in TABLE_SUFFIXES and file.is_file())
    tables = [file for file in files if is_truth_table(file)]
    usual = [file for file in tables if file.name.lower() == _USUAL_NAME]
    if len(tables) > 1 and not usual:
        raise UserError(f"{tables[0]} and {tables[1]} both list places of photos; name the one to use with truth=FILE")
    return next(iter(usual or tables), None)


def _counted(names: list[str], reason: str, total: int) -> str:
    if len(names) == 1:
        return f"{names[0]}: no truth ({reason})"
    return f"{len(names)} of {total} photos have no truth ({reason}), the first is {names[0]}"
