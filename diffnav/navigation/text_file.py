"""Text written to files whole or not at all."""

import os
from pathlib import Path

from diffnav.errors import UserError


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 file, whole or not at all, line ends as they are. Raises: UserError if it cannot be written."""
    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            aside.write_bytes(text.encode("utf-8"))
            os.replace(aside, path)
        finally:
            aside.unlink(missing_ok=True)
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error.strerror}); choose another out=") from None
