"""Ctrl-C on python -m eval.matching in a process of its own."""

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_done(tmp_path: Path) -> None:
    """Interrupted with two workers at it, the command leaves its records; the same command finishes them."""
    out = tmp_path / "out"
    given = [
        f"out={out}",
        f"cache={tmp_path / 'cache'}",
        "data=scenes",
        "data.photos.count=12",
        "matchers=[sift]",
        "enhancers=[]",
    ]
    command = [sys.executable, "-m", "eval.matching", *given, "data.photos.size=[200,300]", "device=cpu", "workers=2"]
    where = {"cwd": ROOT, "env": {**os.environ, "OMP_NUM_THREADS": "1"}, "text": True}
    # A shell that runs the tests in the background ignores the signal, and so would what it starts.
    heed = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=heed, **where)
    started = time.monotonic()
    while not (out / "records.jsonl").exists() or len((out / "records.jsonl").read_text().splitlines()) < 6:
        assert running.poll() is None, running.communicate()
        assert time.monotonic() - started < 300
        time.sleep(0.05)
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=60)
    assert running.returncode == 1
    assert said.strip().endswith("interrupted")
    assert "Traceback" not in said
    kept = len((out / "records.jsonl").read_text().splitlines())
    assert 6 <= kept < 60
    again = subprocess.run(command, capture_output=True, check=True, **where).stdout
    assert f"60 results, {kept} of them from before" in again
