"""How long the stages of a piece of work took."""

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """milliseconds: of each stage by name, added up over its turns."""

    def __init__(self) -> None:
        self.milliseconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Adds the time that the `with` block takes to a stage."""
        start = time.perf_counter()
        try:
            yield
        finally:
            passed = 1000 * (time.perf_counter() - start)
            self.milliseconds[name] = self.milliseconds.get(name, 0.0) + passed
