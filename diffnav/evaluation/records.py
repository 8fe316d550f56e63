"""Per-image results on disk, written as they come: a stopped evaluation goes on where it stood."""

import json
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

    kind: the records' dataclass. `reused` counts those that `find` returned from an earlier call.

    Raises: UserError if the file cannot be written.
    """

    def __init__(self, path: Path | None, kind: type[R]) -> None:
        self.path = path
        self.kind = kind
        self.reused = 0
        self._records: dict[str, R] = {}
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

    def add(self, record: R) -> None:
        """Keep a record, on disk at once."""
        self._records[record.key] = record
        if self.path is not None:
            with self.path.open("a") as file:
                file.write(json.dumps(asdict(record)) + "\n")

    def _open(self, path: Path) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            lines = path.read_text().splitlines(keepends=True) if path.exists() else []
            whole = [line for line in lines if line.endswith("\n")]
            for line in whole:
                record = self.kind(**json.loads(line))
                # Failures are tried again: they may have come from a lack of memory.
                if record.failure is None:
                    self._records[record.key] = record
            # A process that was killed while writing leaves half a line, which the next one must not continue.
            if len(whole) < len(lines):
                path.write_text("".join(whole))
        except OSError as error:
            raise UserError(f"{path}: cannot be written ({error.strerror}); choose another out=") from None
        except (TypeError, ValueError):
            raise UserError(f"{path}: not the records of an evaluation; remove it or choose another out=") from None
