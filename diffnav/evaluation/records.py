"""Per-image results on disk, written as they come: a stopped evaluation goes on where it stood."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from diffnav.errors import UserError


@dataclass(frozen=True)
class ImageRecord:
    """What one method made of one pair.

    key: of method and pair (`prediction_key`). gamma: of the darkening, None for real darkness. psnr in dB, ssim:
    against the daylight picture; of the dark input where the method failed. seconds: of the enhancement alone, None
    where it failed. failure: why it failed. state: figures of R, I, Ih (`component_state`), for Retinex networks.
    device: that the seconds were taken on.
    """

    key: str
    method: str
    name: str
    site: str
    gamma: float | None
    height: int
    width: int
    psnr: float
    ssim: float
    seconds: float | None
    failure: str | None = None
    state: dict[str, float] = field(default_factory=dict)
    device: str = ""

    def flat(self) -> dict[str, object]:
        """The fields as one row of a table, the state's figures behind the others."""
        row = asdict(self)
        state = row.pop("state")
        return row | state


class Record(Protocol):
    """A dataclass of plain values with a key that says what it was made of, and why it failed, if it did."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def key(self) -> str: ...
    @property
    def failure(self) -> str | None: ...


R = TypeVar("R", bound=Record)


class RecordLog(Generic[R]):
    """A file of records, one JSON object a line, that only grows; with `path` None they are kept in memory alone.

    kind: the records' dataclass. beside: files of other processes' records, which are read as well. `reused` counts
    those that `find` returned from an earlier call.

    Raises: UserError if the file cannot be written, or one holds other things.
    """

    def __init__(self, path: Path | None, kind: type[R], beside: Sequence[Path] = ()) -> None:
        self.path = path
        self.kind = kind
        self.reused = 0
        self._records: dict[str, R] = {}
        self._failed: dict[str, R] = {}
        for other in beside:
            self._read(other)
        if path is not None:
            self._open(path)

    @property
    def keys(self) -> frozenset[str]:
        """The keys of all records that `find` would return."""
        return frozenset(self._records)

    def find(self, key: str) -> R | None:
        """The record with this key, if there is one."""
        record = self._records.get(key)
        self.reused += record is not None
        return record

    def find_failure(self, key: str) -> R | None:
        """The failure with this key from an earlier call, if there is one; `find` does not return it."""
        return self._failed.get(key)

    def add(self, record: R) -> None:
        """Keep a record, on disk at once."""
        self._records[record.key] = record
        if self.path is not None:
            with self.path.open("a") as file:
                file.write(json.dumps(asdict(record)) + "\n")

    def _open(self, path: Path) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            lines = self._read(path) if path.exists() else []
            # A process that was killed while writing leaves half a line, which the next one must not continue.
            if lines and not lines[-1].endswith("\n"):
                path.write_text("".join(lines[:-1]))
        except OSError as error:
            raise UserError(f"{path}: cannot be written ({error.strerror}); choose another out=") from None

    def _read(self, path: Path) -> list[str]:
        """Take a file's records; its lines. Raises: UserError if it holds other things; OSError."""
        lines = path.read_text().splitlines(keepends=True)
        try:
            for line in lines:
                if line.endswith("\n"):
                    record = self.kind(**json.loads(line))
                    # Failures are tried again: they may have come from a lack of memory.
                    (self._records if record.failure is None else self._failed)[record.key] = record
        except (TypeError, ValueError):
            raise UserError(f"{path}: not the records of an evaluation; remove it or choose another out=") from None
        return lines
