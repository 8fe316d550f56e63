"""A folder that one process at a time writes in."""

from pathlib import Path

from diffnav.errors import UserError

try:
    import fcntl
except ImportError:  # Windows has no flock: there a user must take care
    fcntl = None  # type: ignore[assignment]


class FolderLock:
    """Held from construction to `release`, or to the end of the process, however it ends.

    Raises: UserError if another process holds it.
    """

    def __init__(self, folder: Path) -> None:
        self._file = (folder / "lock").open("w")
        if fcntl is None:
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise UserError(
                f"{folder}: another process is training in this run's folder; wait for it, or give another run= name"
            ) from None

    def release(self) -> None:
        """Let others write; more than once does nothing."""
        self._file.close()
