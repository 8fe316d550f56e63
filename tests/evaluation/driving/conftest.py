"""The command eval.driving on a tiny drive in files."""

import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from driving_stubs import drive_test, gms, methods, noise_drive

from diffnav.data.driving.driving_set import DrivingSet
from diffnav.enhancers.gamma_blind import GammaBlind
from diffnav.enhancers.input import Input
from diffnav.enhancers.normal import Normal
from diffnav.evaluation.contest import NamedMatcher
from diffnav.evaluation.driving.drive_test import DriveTest
from diffnav.matching.sift import Sift
from eval.driving import main

Localise = Callable[..., Any]


@pytest.fixture(scope="module")
def drive() -> DrivingSet:
    return noise_drive(4)


@pytest.fixture(scope="module")
def task(drive: DrivingSet) -> DriveTest:
    """The dark picture, brightened and by daylight, with two matchers."""
    rows = methods(input=Input(), gamma_blind=GammaBlind(), normal=Normal())
    return drive_test(drive, rows, [gms(threshold_factor=2.0), NamedMatcher("sift", Sift(features=80))])


@pytest.fixture(scope="session")
def street(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """left/ and right/ with four pictures each, in a folder whose name needs quoting."""
    folder = tmp_path_factory.mktemp("drive, day=1")
    noise_drive(4, folder)
    return folder


@pytest.fixture(scope="session")
def shared_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Features of the references are found once for all tests."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def localise(
    street: Path,
    shared_cache: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> Localise:
    """Run the command in this process on the drive's two folders, results in tmp_path/out; out and err of what it said.

    Settings given as ... are left to the command.
    """

    def run(**settings: Any) -> Any:
        plain = {
            "data": "paired",
            "data.left": f'"{street / "left"}"',
            "data.right": f'"{street / "right"}"',
            "always": "[input,normal]",
            "checkpoint": "[]",
            "matchers": "[{orb_gms: {rotation: false, threshold_factor: 2.0}}]",
            "figures": 0,
            "out": tmp_path / "out",
            "paths.runs": tmp_path / "runs",
            "cache": shared_cache,
            "workers": 1,
            "device": "cpu",
        }
        chosen = {key: value for key, value in (plain | settings).items() if value is not ...}
        monkeypatch.setattr(sys, "argv", ["eval.driving", *(f"{k}={v}" for k, v in chosen.items())])
        main()
        return capsys.readouterr()

    return run


@pytest.fixture
def mistake(localise: Localise, refusal: Callable[..., str]) -> Callable[..., str]:
    """Run the command, which must end with exit code 2; its sentence."""
    return partial(refusal, localise)


@pytest.fixture
def summary(tmp_path: Path) -> Callable[..., dict]:
    """driving.json of a folder, without the figures that no two runs share."""

    def read(out: str = "out") -> dict:
        content = json.loads((tmp_path / out / "driving.json").read_text(), parse_constant=pytest.fail)
        rows = [{key: value for key, value in row.items() if key != "seconds"} for row in content["rows"]]
        return {"rows": rows, "protocol": content["protocol"]}

    return read
