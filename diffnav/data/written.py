"""A paired data set on disk, made the paper's way, and the manifest that tells how each picture was darkened.

FOLDER/settings.json     what decides every picture: size, darkness, seed, quality of the daylight JPEG
       manifest.jsonl    one line a pair: names, source, hashes, every number of the darkening
       low/NAME.jpg  normal/NAME.jpg
"""

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from diffnav.darkness import Darkening
from diffnav.data.photos import Photo
from diffnav.errors import UserError

MANIFEST, SETTINGS = "manifest.jsonl", "settings.json"
_NUMBERS = tuple(field.name for field in dataclasses.fields(Darkening) if field.name != "normal")


@dataclass(frozen=True)
class Entry:
    """One line of the manifest.

    name, site: the photo's. low, normal: files below the data set's folder, with the SHA-256 of each. source:
    the file below the folder it was made from, and its SHA-256. record: the darkening.
    """

    name: str
    site: str
    low: str
    normal: str
    source: str
    low_sha256: str
    normal_sha256: str
    source_sha256: str
    record: Darkening

    def line(self) -> str:
        """The entry as one line of JSON, the darkening's numbers beside the rest."""
        texts = {key: value for key, value in self.__dict__.items() if key != "record"}
        return json.dumps({**texts, **self.record.numbers()}) + "\n"

    @classmethod
    def parse(cls, line: str) -> "Entry":
        """The entry of a line. Raises: ValueError, KeyError or TypeError if it is none."""
        values: dict[str, Any] = json.loads(line)
        numbers = {name: values[name] for name in _NUMBERS}
        record = Darkening(**{**numbers, "cast": tuple(numbers["cast"])})
        return cls(record=record, **{f.name: values[f.name] for f in dataclasses.fields(cls) if f.name != "record"})


def written_photos(root: str | Path) -> list[Photo]:
    """The pairs of a data set written by `python -m train.darken`, by name: low, normal and the darkening of each.

    Raises: UserError if the folder is no such data set, or its manifest is damaged.
    """
    root = Path(root).expanduser()
    if not (root / MANIFEST).is_file():
        raise UserError(
            f"no {MANIFEST} in {root}: a written data set is folders low and normal beside {MANIFEST}; "
            "make one with python -m train.darken"
        )
    entries = read_manifest(root)
    if not entries:
        raise UserError(f"{root / MANIFEST} lists no picture; run python -m train.darken again")
    return [
        Photo(name=entry.name, site=entry.site, normal=root / entry.normal, low=root / entry.low, record=entry.record)
        for _, entry in sorted(entries.items())
    ]


def read_manifest(root: Path) -> dict[str, Entry]:
    """Name -> entry, the last line of a name counting; empty without manifest. A half-written end is passed over.

    Raises: UserError naming the line that cannot be read.
    """
    path = root / MANIFEST
    entries: dict[str, Entry] = {}
    for number, line in enumerate(path.read_text().splitlines(keepends=True) if path.exists() else [], start=1):
        if not line.endswith("\n"):
            break
        try:
            entry = Entry.parse(line)
        except (ValueError, KeyError, TypeError):
            raise UserError(
                f"{path}: line {number} is damaged; remove it and run python -m train.darken again"
            ) from None
        entries[entry.name] = entry
    return entries
