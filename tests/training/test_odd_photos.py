"""A folder as users have them: bad files are named before the first step, and no step dies of one."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tiny_training import picture

from train import decom


@pytest.fixture
def odd(tmp_path: Path) -> Path:
    folder = tmp_path / "odd photos"
    folder.mkdir()
    for number in range(4):
        Image.fromarray(picture(number, 48, 64)).save(folder / f"good_{number}.jpg")
    buffer = io.BytesIO()
    Image.fromarray(picture(7, 200, 200)).save(buffer, "JPEG")
    (folder / "truncated_1.jpg").write_bytes(buffer.getvalue()[:3000])
    (folder / "text_1.jpg").write_text("not a picture")
    (folder / "empty_1.png").touch()
    (folder / "notes.txt").write_text("ignored by its kind")
    Image.fromarray(picture(8, 20, 90)).save(folder / "tiny_1.png")
    deep = (picture(9, 50, 50)[..., 0].astype(np.uint16) * 257).astype(np.uint16)
    Image.fromarray(deep).save(folder / "deep_1.png")
    Image.fromarray(picture(10, 40, 40)).convert("CMYK").save(folder / "press_1.jpg")
    Image.fromarray(picture(11, 40, 40)[..., 0]).save(folder / "grey_1.png")
    return folder


def settings(folder: Path) -> tuple[str, ...]:
    """The 16-bit picture is the validation set."""
    return f'data.root="{folder}"', "data.split={by: sources, sources: [deep]}", "run=a"


def test_train_and_are_named_beforehand(odd: Path, tiny, tmp_path: Path, door, capsys) -> None:
    """An epoch is at most 7 photos, so 10 steps of 2 see every photo that was kept."""
    door(decom.main, *tiny, *settings(odd), "training.steps=10")
    lines = capsys.readouterr().err.replace("\r", "\n").splitlines()
    named = [line for line in lines if line.startswith("left out: ")]
    assert len(named) == 4
    for name in ("truncated_1.jpg", "text_1.jpg", "empty_1.png", "tiny_1.png"):
        assert any(name in line for line in named)
    first_step = next(number for number, line in enumerate(lines) if "/10 [" in line and "step" in line)
    assert max(lines.index(line) for line in named) < first_step
    assert not any("notes" in line for line in lines)
    assert (tmp_path / "a/state.pt").exists()


def test_nothing_usable_is_one_sentence(odd: Path, tiny, refusal) -> None:
    for path in odd.glob("good_*"):
        path.write_text("")
    for path in [*odd.glob("press*"), *odd.glob("grey*")]:
        path.unlink()
    words = refusal(decom.main, *tiny, *settings(odd))
    assert "none of 8 photos can be used; the first: " in words


def test_empty_folder_is_one_sentence(tmp_path: Path, tiny, refusal) -> None:
    (tmp_path / "nothing").mkdir()
    words = refusal(decom.main, *tiny, "run=a", f"data.root={tmp_path / 'nothing'}")
    assert f"no images in {tmp_path / 'nothing'}" in words
