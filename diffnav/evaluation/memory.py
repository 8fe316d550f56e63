"""How much memory a computation takes: measured in a process of its own."""

import multiprocessing
import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.context import BaseContext
from pathlib import Path
from typing import Any

import torch

from diffnav.errors import UserError


def in_own_process(function: Callable[..., Any], *arguments: Any) -> Any:
    """`function(*arguments)`, computed in a fresh process, whose peak of memory is nobody else's.

    Raises: UserError if that process was ended from outside, as systems do that run out of memory.
    """
    with ProcessPoolExecutor(1, fresh_processes("diffnav.evaluation.training_speed", "torch._dynamo")) as pool:
        try:
            return pool.submit(function, *arguments).result()
        except BrokenProcessPool:
            raise UserError(
                f"the process of {function.__name__} was ended by the system, probably for want of memory: "
                "give it more, or a smaller size"
            ) from None


def fresh_processes(*preload: str) -> BaseContext:
    """How to start them: where possible as copies of a process that has imported the modules `preload`, no more.

    torch._dynamo is what an optimiser's first step imports.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(preload))
    return context


def peak_memory_gb(device: torch.device) -> float:
    """The most that this process has held so far, 10^9 bytes: tensors on a GPU; on a CPU all that is resident."""
    if device.type == "cuda":
        return torch.cuda.max_memory_allocated(device) / 1e9
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
        # Not getrusage: its maximum begins with what the parent held when it started this process.
        peak_kib = next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:"))
    except (OSError, StopIteration):
        import resource

        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        peak_kib = peak // 1024 if sys.platform == "darwin" else peak
    return peak_kib * 1024 / 1e9


class TreeMemory:
    """While entered, watches how much memory this process and those that it started hold together.

    peak_gb: the most so far, 10^9 bytes, sampled every half second; shared pages count for each process. Linux only,
    elsewhere this process alone.
    """

    def __init__(self) -> None:
        self.peak_gb = 0.0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> "TreeMemory":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def _watch(self) -> None:
        while True:
            self.peak_gb = max(self.peak_gb, _tree_gb() or peak_memory_gb(torch.device("cpu")))
            if self._over.wait(0.5):
                return


def _tree_gb() -> float:
    """What this process and its descendants hold, 10^9 bytes; 0 where the system does not tell."""
    parents, held_kib = {}, {}
    for status in Path("/proc").glob("[0-9]*/status"):
        try:
            facts = dict(line.split(":", 1) for line in status.read_text().splitlines() if ":" in line)
        except OSError:
            continue  # it has ended
        parents[int(facts["Pid"])] = int(facts["PPid"])
        held_kib[int(facts["Pid"])] = int(facts.get("VmRSS", "0").split()[0])

    def is_ours(process: int) -> bool:
        while process not in (0, os.getpid()):
            process = parents.get(process, 0)
        return process != 0

    return sum(held for process, held in held_kib.items() if is_ours(process)) * 1024 / 1e9
