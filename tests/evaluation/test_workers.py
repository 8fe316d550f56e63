"""Work over processes: everything arrives, mistakes surface, nothing is left running."""

import os
import signal
import time

import cv2
import pytest
import torch

from diffnav.errors import UserError
from diffnav.evaluation.workers import available_cores, one_thread, spread


class Task:
    """Yields (number, k, process, threads) for k below the number; goes wrong as it was told to."""

    def __init__(self, mistake=None, at=None):
        self.mistake = mistake
        self.at = at

    def __call__(self, number):
        for k in range(number):
            if number == self.at:
                self.go_wrong()
            yield number, k, os.getpid(), torch.get_num_threads(), cv2.getNumThreads()

    def go_wrong(self):
        if self.mistake == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        if self.mistake == "slow":
            time.sleep(60)
        raise self.mistake


def test_one_worker_is_this_process_on_one_thread():
    before = torch.get_num_threads(), cv2.getNumThreads()
    results = list(spread(Task(), [2, 1], 1))
    assert results == [(0, (2, k, os.getpid(), 1, 1)) for k in (0, 1)] + [(1, (1, 0, os.getpid(), 1, 1))]
    assert (torch.get_num_threads(), cv2.getNumThreads()) == before


def test_mistakes_of_this_process_are_as_they_were():
    with pytest.raises(KeyError, match="bug"):
        list(spread(Task(KeyError("bug"), at=1), [1], 1))


def test_several_workers_do_everything_once():
    items = [3, 0, 5, 2, 4, 1]
    results = list(spread(Task(), items, 2))
    assert sorted((index, number, k) for index, (number, k, *_) in results) == sorted(
        (index, number, k) for index, number in enumerate(items) for k in range(number)
    )
    assert all((torch_threads, cv_threads) == (1, 1) for _, (_, _, _, torch_threads, cv_threads) in results)
    assert os.getpid() not in {process for _, (_, _, process, *_) in results}


@pytest.mark.parametrize(
    ("mistake", "kind", "words"),
    [
        (UserError("no such file: give one"), UserError, "^no such file: give one$"),
        (KeyError("bug"), RuntimeError, "go_wrong.*KeyError: 'bug'"),
        ("killed", UserError, "ended by the system.*fewer workers="),
    ],
)
def test_what_goes_wrong_in_a_worker_surfaces(mistake, kind, words):
    with pytest.raises(kind, match=f"(?s){words}"):
        list(spread(Task(mistake, at=2), [1, 2, 3], 2))


def test_who_stops_iterating_ends_the_processes():
    results = spread(Task("slow", at=9), [9, 1, 2], 2)
    _, (_, _, process, *_) = next(results)
    start = time.monotonic()
    results.close()
    assert time.monotonic() - start < 30
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)


def test_cores_and_threads():
    assert 1 <= available_cores() <= (os.cpu_count() or 1)
    with one_thread():
        assert torch.get_num_threads() == cv2.getNumThreads() == 1
