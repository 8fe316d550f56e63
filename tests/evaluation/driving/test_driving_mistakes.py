"""What eval.driving says of bad pictures: one sentence and exit code 2, or a note, and the rest is measured."""

import shutil
from pathlib import Path

import pytest
from driving_stubs import view

from diffnav.images import write_image


@pytest.fixture
def own(street: Path, tmp_path: Path) -> tuple[Path, dict]:
    """(a copy of the drive that may be spoilt, the settings that measure it)."""
    root = tmp_path / "own"
    shutil.copytree(street, root)
    return root, {"data.left": root / "left", "data.right": root / "right"}


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:2000])


def test_a_missing_camera_folder(mistake, own: tuple[Path, dict]) -> None:
    root, settings = own
    shutil.rmtree(root / "right")
    assert f"no folder {root / 'right'}: give an existing folder of images" in mistake(**settings)
    (root / "right").mkdir()
    assert f"no images in {root / 'right'}" in mistake(**settings)
    assert "are one folder" in mistake(**settings | {"data.right": root / "left"})


def test_a_missing_camera_of_a_known_layout(mistake, tmp_path: Path) -> None:
    write_image(tmp_path / "kitti" / "image_0" / "000000.png", view(0))
    settings = {"data": "kitti_odometry", "data.left": ..., "data.right": ..., "data.root": tmp_path / "kitti"}
    said = mistake(**settings)
    assert str(tmp_path / "kitti") in said
    assert "image_1" in said


def test_pictures_without_partners(localise, mistake, own: tuple[Path, dict]) -> None:
    root, settings = own
    (root / "left" / "3.png").rename(root / "left" / "33.png")
    printed = localise(**settings)
    assert "drive: 3 pairs" in printed.out
    notes = [line for line in printed.err.splitlines() if line.startswith("note: ")]
    assert notes == [
        "note: right/3: no query in record drive named 3; left out",
        "note: left/33: no reference in record drive named 33; left out",
    ]
    for k in range(3):
        (root / "left" / f"{k}.png").rename(root / "left" / f"{k}{k}.png")
    said = mistake(**settings)
    assert "no picture has a partner (queries: 4 pictures, e.g. left/00; references: 4 pictures, e.g. right/0)" in said


def test_pictures_of_different_sizes(localise, summary, own: tuple[Path, dict]) -> None:
    root, settings = own
    write_image(root / "right" / "1.png", view(29)[:, :90, :150])
    printed = localise(**settings)
    note = "references have 2 sizes (150 x 90, 160 x 96), matched as they are"
    assert f"note: {note}\n" in printed.err
    assert summary()["protocol"]["remarks"] == [note]
    assert {row["queries"] for row in summary()["rows"]} == {4}


def test_grey_and_colour_mixed(localise, own: tuple[Path, dict]) -> None:
    root, settings = own
    for k in range(3):
        grey = view(24 * k + 5).mean(0, keepdim=True).expand(3, -1, -1)
        write_image(root / "right" / f"{k}.png", grey)
    assert "note: 3 of 4 references are grey, the others in colour\n" in localise(**settings).err
    # All of them grey is nothing to speak of.
    write_image(root / "right" / "3.png", grey)
    assert "note:" not in localise(**settings).err


def test_a_truncated_reference(localise, mistake, summary, own: tuple[Path, dict]) -> None:
    root, settings = own
    truncate(root / "right" / "2.png")
    printed = localise(**settings)
    assert "drive: 3 pairs" in printed.out
    (note,) = [line for line in printed.err.replace("\r", "\n").splitlines() if line.startswith("note: ")]
    assert note.startswith(f"note: {root / 'right' / '2.png'}: damaged image")
    assert note.endswith("its pair is left out")
    assert {(row["queries"], row["references"]) for row in summary()["rows"]} == {(3, 3)}
    for path in (root / "right").iterdir():
        path.write_bytes(b"no picture")
    assert "no pair is left; " in mistake(**settings)


def test_a_truncated_query(localise, mistake, summary, own: tuple[Path, dict], tmp_path: Path) -> None:
    """It stays in the denominator; the others are answered."""
    root, settings = own
    truncate(root / "left" / "2.png")
    printed = localise(**settings, figures=1)
    told = [line for line in printed.err.replace("\r", "\n").splitlines() if line.startswith("failed: ")]
    assert len(told) == 2
    for line, method in zip(told, ("input", "normal"), strict=True):
        assert line.startswith(f"failed: {method} on left/2: {root / 'left' / '2.png'}: damaged image")
    rows = {(row["method"], row["ranking"]): row for row in summary()["rows"]}
    assert (rows["normal", "matches"]["queries"], rows["normal", "matches"]["accuracy"]) == (4, 0.75)
    assert f"- {told[0].removeprefix('failed: ')}" in (tmp_path / "out" / "driving.md").read_text()
    # Mended, it alone is asked again.
    shutil.copy(root / "left" / "3.png", root / "left" / "2.png")
    assert "8 answers, 6 of them from before" in localise(**settings).out
    for path in (root / "left").iterdir():
        truncate(path)
    assert "no query could be answered: " in mistake(**settings)


def test_a_matcher_without_its_weights(mistake, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("DIFFNAV_WEIGHTS", str(tmp_path))
    assert "loftr" in mistake(matchers="[loftr]")


def test_folders_that_cannot_be_written(mistake, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert "choose another out=" in mistake(out=tmp_path / "file" / "out")
    assert "choose another cache=" in mistake(cache=tmp_path / "file" / "cache")
    (tmp_path / "out").mkdir(exist_ok=True)
    for name in ("records.jsonl", "records-1-of-2.jsonl"):
        (tmp_path / "out" / name).write_text("something else\n")
        assert f"{name}: not the records of an evaluation" in mistake()
        (tmp_path / "out" / name).unlink()
