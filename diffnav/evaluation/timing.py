"""Timing side by side: phases of a computation, and several computations in turn."""

import statistics
import time
from collections.abc import Sequence
from typing import Protocol

import torch
from tqdm import tqdm

Seconds = dict[str, float]
PHASES = ("data", "forward", "backward", "optimiser", "other")


class PhaseClock:
    """Seconds between marks, added to the phase that the earlier mark named; every moment counts to one phase."""

    def __init__(self, device: torch.device) -> None:
        self._device = device

    def start(self, phase: str) -> None:
        self._seconds: Seconds = dict.fromkeys(PHASES, 0.0)
        self._phase, self._since = phase, self._now()

    def mark(self, phase: str) -> None:
        now = self._now()
        self._seconds[self._phase] += now - self._since
        self._phase, self._since = phase, now

    def stop(self) -> Seconds:
        self.mark("other")
        return self._seconds

    def _now(self) -> float:
        if self._device.type == "cuda":
            torch.cuda.synchronize(self._device)
        return time.perf_counter()


class Timer(Protocol):
    """Something with a name that can be run again and again, and tells the seconds of its phases."""

    name: str

    def run(self) -> Seconds: ...


def interleave(timers: Sequence[Timer], repeats: int, warmup: int) -> dict[str, Seconds]:
    """Name -> median seconds of each phase over `repeats` runs, after `warmup` further runs that do not count.

    All take turns, so that a machine that is busy for a while slows all of them alike and ratios stay.
    """
    runs: dict[str, list[Seconds]] = {timer.name: [] for timer in timers}
    with tqdm(total=(warmup + repeats) * len(timers), desc="timing", unit="run") as bar:
        for turn in range(warmup + repeats):
            for timer in timers:
                seconds = timer.run()
                bar.update()
                if turn >= warmup:
                    runs[timer.name].append(seconds)
    return {
        name: {phase: statistics.median(run[phase] for run in own) for phase in PHASES} for name, own in runs.items()
    }
