"""python -m train.darken from its command line to its folder."""

from collections.abc import Callable
from pathlib import Path

import pytest

from diffnav.data.written import written_photos
from train import darken, decom


def test_writes_resumes_and_can_be_trained_on(photos: Path, tiny, tmp_path: Path, door: Callable, capsys) -> None:
    out = tmp_path / "pairs, 60x40"
    arguments = (f'images="{photos}"', f'out="{out}"', "size=[40,60]", "seed=3")
    door(darken.main, *arguments)
    assert "6 pairs written, 0 already there, 0 left out" in capsys.readouterr().out
    assert {photo.read_low().shape for photo in written_photos(out)} == {(3, 40, 60)}
    door(darken.main, *arguments)
    assert "0 pairs written, 6 already there, 0 left out" in capsys.readouterr().out
    door(decom.main, *tiny, "data=written", f'data.root="{out}"', "run=a", "training.steps=2")
    assert (tmp_path / "a/state.pt").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "the setting images is missing"),
        (["images=/no/such"], "the setting out is missing"),
        (["images=/no/such", "out=/tmp/diffnav-never"], "no folder /no/such"),
        (["images=/no/such", "out=/tmp/diffnav-never", "darkness=moonlight"], "darkness can be long_exposure, paper"),
        (["images=/no/such", "out=/tmp/diffnav-never", "size=40"], "size must be [height, width]"),
    ],
)
def test_mistakes_are_one_sentence(arguments: list[str], words: str, refusal: Callable) -> None:
    assert words in refusal(darken.main, *arguments)


def test_unreadable_files_are_named(photos: Path, tmp_path: Path, door: Callable, capsys) -> None:
    folder = tmp_path / "images"
    folder.mkdir()
    (folder / "good.png").write_bytes((photos / "roof_1.png").read_bytes())
    (folder / "bad.png").write_text("no picture")
    door(darken.main, f"images={folder}", f"out={tmp_path / 'out'}", "size=null")
    said = capsys.readouterr()
    assert f"left out: {folder / 'bad.png'}: not an image" in said.err
    assert "1 pairs written, 0 already there, 1 left out" in said.out
