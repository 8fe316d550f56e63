"""Work spread over processes of one thread each, whose results come back as they are made."""

import multiprocessing
import os
import pickle
import signal
import sys
import traceback
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

import cv2
import torch

from diffnav.errors import UserError
from diffnav.evaluation.memory import fresh_processes

Item = TypeVar("Item")
Result = TypeVar("Result")


def spread(
    task: Callable[[Item], Iterable[Result]], items: Sequence[Item], workers: int
) -> Generator[tuple[int, Result], None, None]:
    """(index of its item, result) for everything that `task` yields for the items, in the order in which it is made.

    One worker is this process; of several, each is a process with a copy of `task` (it and the items are pickled)
    that takes one item after the other. All compute on one thread, so that results do not depend on their number.
    Whoever stops iterating, by Ctrl-C too, ends the processes.

    Raises:
        UserError: as `task` raises it, or because the system ended a process.
        RuntimeError: for anything else that `task` raises in another process.
    """
    if min(workers, len(items)) <= 1:
        with one_thread():
            for index, item in enumerate(items):
                for result in task(item):
                    yield index, result
        return
    context = fresh_processes("diffnav.evaluation.matching")
    # Pickled here: multiprocessing's own way would share tensors through files that are closed too early.
    payload, counter = pickle.dumps((task, items)), context.Value("q", 0)
    crew: dict[Connection, Any] = {}
    try:
        for _ in range(min(workers, len(items))):
            receiver, sender = context.Pipe(duplex=False)
            process = context.Process(target=_work, args=(payload, counter, sender), daemon=True)  # type: ignore[attr-defined]
            process.start()
            sender.close()
            crew[receiver] = process
        yield from _receive(crew)
    finally:
        for process in crew.values():
            process.terminate()
            process.join()


def available_cores() -> int:
    """How many processor cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else multiprocessing.cpu_count()


@contextmanager
def one_thread() -> Iterator[None]:
    """While entered, torch and OpenCV compute on one thread."""
    before = torch.get_num_threads(), cv2.getNumThreads()
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before[0])
        cv2.setNumThreads(before[1])


def _receive(crew: dict[Connection, Any]) -> Iterator[tuple[int, Any]]:
    """Everything that the processes send, until each of them has closed its connection."""
    open_connections = list(crew)
    while open_connections:
        for connection in wait(open_connections):
            assert isinstance(connection, Connection)
            try:
                message = connection.recv()
            except EOFError:
                open_connections.remove(connection)
                crew[connection].join()
                if crew[connection].exitcode:
                    raise UserError(
                        "a worker process was ended by the system, probably for want of memory: use fewer workers="
                    ) from None
                continue
            if isinstance(message, Exception):
                raise message
            yield message


def _work(payload: bytes, counter: Any, sender: Connection) -> None:
    """The life of one process: the next item that nobody has taken, until there is none."""
    # Ctrl-C reaches all processes of a terminal; the one that started these ends them, and they leave tidily.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    try:
        task, items = pickle.loads(payload)
        while (index := _next(counter)) < len(items):
            for result in task(items[index]):
                sender.send((index, result))
    except BrokenPipeError:
        return  # nobody listens any more
    except UserError as error:
        sender.send(error)
    except Exception:
        sender.send(RuntimeError(f"in a worker process:\n{traceback.format_exc()}"))
    finally:
        sender.close()


def _next(counter: Any) -> int:
    with counter.get_lock():
        counter.value += 1
        return counter.value - 1
