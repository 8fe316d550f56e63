"""Writing a paired data set: each photo resized and saved as JPEG, darkened from that, saved as JPEG once more."""

import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from tqdm import tqdm

from diffnav.darkness import DarknessModel, expose
from diffnav.data.pairs import photo_seed
from diffnav.data.photos import Photo
from diffnav.data.written import MANIFEST, SETTINGS, Entry, read_manifest
from diffnav.errors import UserError
from diffnav.images import ImageError, read_image, resize, write_image


@dataclass(frozen=True)
class PairSettings:
    """What decides every picture of a written data set.

    size: (h, w) that photos are resized to; None keeps sizes. seed: with the photo's name it decides the
    darkness. quality: of the daylight JPEG, 1 to 100; the dark one's is the darkening's (0: a PNG).

    Raises: UserError naming the setting.
    """

    darkness: DarknessModel
    size: tuple[int, int] | None = (400, 600)
    seed: int = 0
    quality: int = 95

    def __post_init__(self) -> None:
        if not isinstance(self.seed, int):
            raise UserError(f"seed must be a whole number, got {self.seed!r}")
        if not isinstance(self.quality, int) or not 1 <= self.quality <= 100:
            raise UserError(f"quality must be a whole number from 1 to 100, got {self.quality!r}")


@dataclass
class Outcome:
    """What became of the photos: pairs written, pairs that were there already, one sentence for each left out."""

    written: int = 0
    kept: int = 0
    problems: list[str] = field(default_factory=list)


def write_pairs(
    photos: Sequence[Photo], root: str | Path, out: str | Path, settings: PairSettings, progress: bool = False
) -> Outcome:
    """Write low/NAME.jpg, normal/NAME.jpg and a line of the manifest for every photo, a file below `root`.

    Stopped at any moment, the same call goes on: pairs whose source and files still have the manifest's hashes
    stay. Pairs of earlier calls with other photos stay too. Photos that cannot be read are left out.

    Raises: UserError if `out` holds something else, lies in `root`, or was written with other settings, or if
    no photo could be used.
    """
    root, out = Path(root).expanduser(), Path(out).expanduser()
    if out.resolve().is_relative_to(root.resolve()):
        raise UserError(f"out={out} lies in {root}, so that its pictures would be darkened again; choose another out")
    _open_folder(out, settings)
    entries = read_manifest(out)
    _save_manifest(out, entries)
    outcome = Outcome()
    with (out / MANIFEST).open("a") as manifest:
        for photo in tqdm(photos, desc="darkening", unit="photo", disable=not progress):
            try:
                source = _file(photo)
                digest = _sha256(source)
                if _is_written(entries.get(photo.name), digest, out):
                    outcome.kept += 1
                    continue
                entry = _write_pair(photo, source.relative_to(root).as_posix(), digest, out, settings)
            except ImageError as error:
                outcome.problems.append(str(error))
                continue
            entries[photo.name] = entry
            manifest.write(entry.line())
            manifest.flush()
            outcome.written += 1
    _save_manifest(out, entries)
    if not outcome.written + outcome.kept:
        first = f"; the first: {outcome.problems[0]}" if outcome.problems else ""
        raise UserError(f"none of {len(photos)} photos could be used{first}")
    return outcome


def _write_pair(photo: Photo, source: str, source_sha256: str, out: Path, settings: PairSettings) -> Entry:
    """Write one pair; the dark picture is made from the daylight picture as it was saved."""
    normal = photo.read_normal()
    if settings.size is not None:
        normal = resize(normal, settings.size)
    normal_file = f"normal/{photo.name}.jpg"
    write_image(out / normal_file, normal, settings.quality)
    normal = read_image(out / normal_file)
    record = settings.darkness.draw(normal.max().item(), photo_seed(settings.seed, photo.name))
    # Encoded here, once: `darken` would decode it again, and a second JPEG would not hold what it gave.
    low_file = f"low/{photo.name}.{'jpg' if record.quality else 'png'}"
    write_image(out / low_file, expose(normal, record), record.quality)
    return Entry(
        name=photo.name,
        site=photo.site,
        low=low_file,
        normal=normal_file,
        source=source,
        low_sha256=_sha256(out / low_file),
        normal_sha256=_sha256(out / normal_file),
        source_sha256=source_sha256,
        record=record,
    )


def _open_folder(out: Path, settings: PairSettings) -> None:
    """Make the folder, or see that it holds a data set of these settings. Raises: UserError."""
    path = out / SETTINGS
    # As JSON gives it back: tuples become lists.
    wanted = json.loads(json.dumps(asdict(settings)))
    if not path.exists():
        if out.exists() and (not out.is_dir() or any(out.iterdir())):
            raise UserError(f"{out} holds something else than a data set of train.darken; give a new folder as out")
        try:
            out.mkdir(parents=True, exist_ok=True)
            _write_whole(path, json.dumps(wanted, indent=1))
        except OSError as error:
            raise UserError(f"{out}: cannot be written ({error.strerror}); give another folder as out") from None
        return
    try:
        stored = json.loads(path.read_text())
    except ValueError:
        raise UserError(f"{path}: damaged; give a new folder as out") from None
    for key in wanted:
        if stored.get(key) != wanted[key]:
            raise UserError(
                f"{out} was written with {key}={stored.get(key)}, now it is {wanted[key]}: "
                "give the old value to go on, or a new folder as out"
            )


def _is_written(entry: Entry | None, source_sha256: str, out: Path) -> bool:
    """Whether the pair is there, made from this very source."""
    if entry is None or entry.source_sha256 != source_sha256:
        return False
    files = {out / entry.low: entry.low_sha256, out / entry.normal: entry.normal_sha256}
    return all(path.is_file() and _sha256(path) == digest for path, digest in files.items())


def _file(photo: Photo) -> Path:
    if not isinstance(photo.normal, Path):
        raise ValueError(f"{photo.name} is no file; only photos in files can be written as pairs")
    return photo.normal


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise ImageError(f"{path}: cannot be read ({error.strerror})") from None


def _save_manifest(out: Path, entries: dict[str, Entry]) -> None:
    _write_whole(out / MANIFEST, "".join(entry.line() for _, entry in sorted(entries.items())))


def _write_whole(path: Path, text: str) -> None:
    aside = path.with_name(f".{path.name}.part")
    aside.write_text(text)
    os.replace(aside, path)
