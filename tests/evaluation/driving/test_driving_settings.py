"""What eval.driving says of settings that it cannot take: one sentence and exit code 2, before anything is read."""

import sys
from pathlib import Path

import pytest

from eval import enhancement, matching, spectrum


@pytest.mark.parametrize(
    ("settings", "parts"),
    [
        ({"data.left": "/nowhere"}, ["no folder /nowhere"]),
        ({"data.left": ...}, ["the setting data.left is missing: add data.left="]),
        ({"data": "moon", "data.left": ..., "data.right": ...}, ["unknown data=moon", "zpark", "kitti_odometry"]),
        ({"data.tolerance_s": -1}, ["data.tolerance_s must be 0 or more"]),
        ({"step": 0}, ["step must be a whole number of 1 or more"]),
        ({"shard": "[2,2]"}, ["shard must be [index, count]", "got [2, 2]"]),
        ({"shard": "3"}, ["shard must be [index, count], e.g. [0,4], got [3]"]),
        ({"shortlist": 0}, ["shortlist must be a whole number of 1 or more"]),
        ({"verified": -1}, ["verified must be a whole number of 0 or more"]),
        ({"longest_side": 16}, ["longest_side must be a whole number of 64 or more"]),
        ({"figures": -1}, ["figures must be a whole number of 0 or more"]),
        ({"workers": 0}, ["workers must be a whole number of 1 or more"]),
        ({"verification.model": "homography"}, ["verification.model must be fundamental", "a street is no plane"]),
        ({"verification.threshold_px": -1}, ["verification.threshold_px must be above 0, got -1"]),
        ({"darkness.gamma": "[5,3]"}, ["gamma"]),
        ({"matchers": "[]"}, ["matchers is empty"]),
        ({"matchers": "[sifd]"}, ["unknown matcher 'sifd'"]),
        ({"checkpoint": "nowhere.pt"}, ["nowhere.pt"]),
    ],
)
def test_settings(settings: dict, parts: list[str], mistake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("a picture was read")

    # It is found out before the first picture is read.
    monkeypatch.setattr("diffnav.data.driving.driving_set.read_image", refuse)
    said = mistake(**settings, cache=tmp_path / "cache")
    for part in parts:
        assert part in said


def test_photos_are_no_drive(mistake) -> None:
    said = mistake(**{"data": "aerial_test", "data.left": ..., "data.right": ...})
    assert "data=aerial_test is no driving set; choose e.g. zpark, kitti_odometry" in said


@pytest.mark.parametrize("command", [matching, enhancement, spectrum])
def test_a_drive_is_no_photos(
    command, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    given = ["data=kitti_odometry", "checkpoint=[]", "enhancers=[]", "device=cpu", f"out={tmp_path / 'out'}"]
    monkeypatch.setattr(sys, "argv", ["command", *given, f"paths.runs={tmp_path}"])
    with pytest.raises(SystemExit) as left:
        command.main()
    assert left.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(
        "error: data=kitti_odometry is a driving set, which eval.driving takes; choose one of aerial"
    )
    assert "scenes," in line
    assert "scenes_drive" not in line
