"""Two processes do not train in one folder."""

import subprocess
import sys
from pathlib import Path

import pytest
from tiny_training import ENVIRONMENT, REPOSITORY

from diffnav.errors import UserError
from diffnav.training.lock import FolderLock
from diffnav.training.run import Run

HOLD = "import sys, time; from pathlib import Path; from diffnav.training.lock import FolderLock; "
HOLD += "lock = FolderLock(Path(sys.argv[1])); print('held', flush=True); time.sleep(60)"

pytest.importorskip("fcntl", reason="this system has no flock")


def test_a_folder_is_one_process_s_until_it_ends(tmp_path: Path) -> None:
    """Killed outright, it leaves the folder free."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path)], cwd=REPOSITORY, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "held\n"
    with pytest.raises(UserError, match=f"{tmp_path}: another process is training in this run's folder"):
        Run(tmp_path, {})
    process.kill()
    process.communicate()
    Run(tmp_path, {}).close()


def test_a_released_folder_is_free(tmp_path: Path) -> None:
    lock = FolderLock(tmp_path)
    with pytest.raises(UserError, match="another process"):
        FolderLock(tmp_path)
    lock.release()
    lock.release()
    FolderLock(tmp_path).release()
