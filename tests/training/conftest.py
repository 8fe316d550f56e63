"""A training that takes a second: six small pictures, networks of four channels, patches of 32 x 32."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from PIL import Image
from tiny_training import ENVIRONMENT, REPOSITORY, picture


@pytest.fixture(scope="session")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of six pictures of 72 x 64 pixels, two of each site."""
    folder = tmp_path_factory.mktemp("photos")
    for number, name in enumerate(("field_1", "field_2", "roof_1", "roof_2", "wood_1", "wood_2")):
        Image.fromarray(picture(number, 64, 72)).save(folder / f"{name}.png")
    return folder


@pytest.fixture
def tiny(photos: Path, tmp_path: Path) -> list[str]:
    """Settings of a run of 30 tiny steps below `tmp_path`, logged at every step."""
    return [
        "data=folder",
        f"data.root={photos}",
        "data.size=null",
        "data.patch=32",
        "data.split={by: sources, sources: [wood]}",
        "network.width=4",
        "optimiser.lr=1e-3",
        "training={steps: 30, batch: 2, log_every: 1, validate_every: 10, save_every: 7}",
        "validation={photos: 2, crop: [32, 32]}",
        "device=cpu",
        f"paths.runs={tmp_path}",
    ]


@pytest.fixture
def door(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Run a command's `main` in this process with these arguments."""

    def call(main: Callable[[], None], *arguments: str) -> None:
        monkeypatch.chdir(REPOSITORY)
        monkeypatch.setattr(sys, "argv", ["command", *arguments])
        main()

    return call


@pytest.fixture
def refusal(door: Callable, capsys: pytest.CaptureFixture) -> Callable[..., str]:
    """Run a command that must fail with exit code 2; the one sentence that it says."""

    def call(main: Callable[[], None], *arguments: str) -> str:
        with pytest.raises(SystemExit) as ended:
            door(main, *arguments)
        assert ended.value.code == 2
        (sentence,) = (line for line in capsys.readouterr().err.splitlines() if line.startswith("error: "))
        return sentence

    return call


@pytest.fixture
def start() -> Callable[..., subprocess.Popen]:
    """Start `python -m MODULE arguments` as a process of its own; what still runs at the end is killed."""
    started: list[subprocess.Popen] = []

    def launch(*command: str) -> subprocess.Popen:
        pipe = subprocess.PIPE
        started.append(
            subprocess.Popen(
                [sys.executable, "-m", *command], cwd=REPOSITORY, env=ENVIRONMENT, stdout=pipe, stderr=pipe, text=True
            )
        )
        return started[-1]

    yield launch
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()
