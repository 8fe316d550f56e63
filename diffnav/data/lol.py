"""Real pairs in LOL's layout: low/ beside high/ or normal/, or brackets: under/ beside over/."""

from pathlib import Path

from diffnav.data.photos import Photo, photo_of
from diffnav.errors import UserError
from diffnav.images import find_images

SIDES = (("low", "high"), ("low", "normal"), ("under", "over"))


def lol_photos(root: str | Path) -> list[Photo]:
    """One photo for each name below either folder, its dark and its bright file matched by name without ending.

    A picture without partner is listed with the partner that it should have: reading it fails by that file's
    name, and those who read data sets report it as they report damaged files.

    Args: root: the folder that holds the two, in upper or lower case.
    Raises: UserError, describing the expected folders, if they are missing, hold a name twice, or share no name.
    """
    root = Path(root).expanduser()
    dark, bright = _sides(root)
    low, normal = _by_stem(dark), _by_stem(bright)
    if not low.keys() & normal.keys():
        examples = f"{next(iter(low))} and {next(iter(normal))}"
        raise UserError(f"{dark} and {bright} share no file name ({examples}); name the two of a pair alike")
    photos = []
    for stem in sorted(low.keys() | normal.keys()):
        normal_path = normal.get(stem) or bright / low[stem].relative_to(dark)
        low_path = low.get(stem) or dark / normal[stem].relative_to(bright)
        site = photo_of(normal_path, bright).site
        photos.append(Photo(name=stem, site=site, normal=normal_path, low=low_path))
    return photos


def _sides(root: Path) -> tuple[Path, Path]:
    folders = {path.name.lower(): path for path in sorted(root.glob("*")) if path.is_dir()}
    for dark, bright in SIDES:
        if dark in folders and bright in folders:
            return folders[dark], folders[bright]
    raise UserError(
        f"no pairs in {root}: dark pictures belong in its folder low and their daylight pictures, of equal names, "
        "in high or normal; or brackets in under and over"
    )


def _by_stem(folder: Path) -> dict[str, Path]:
    """Path below the folder without ending -> file."""
    files: dict[str, Path] = {}
    for path in find_images(folder):
        stem = path.relative_to(folder).with_suffix("").as_posix()
        if stem in files:
            raise UserError(f"{files[stem]} and {path} have one name; keep one of them")
        files[stem] = path
    return files
