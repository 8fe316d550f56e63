"""The paired data set on disk: the manifest describes the files exactly, and writing can stop at any moment."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from diffnav.darkness import DarknessModel, darken, invert_gamma
from diffnav.data import writing
from diffnav.data.pairs import WholePairs
from diffnav.data.photos import folder_photos
from diffnav.data.store import PhotoStore
from diffnav.data.writing import PairSettings, write_pairs
from diffnav.data.written import read_manifest, written_photos
from diffnav.errors import UserError
from diffnav.images import read_image

PAPER = DarknessModel()
VARIED = DarknessModel((2.0, 5.5), (70, 98), (0.0, 0.01), (0.0, 0.004), (1.0, 6.0), 0.05)


@pytest.fixture
def images(tmp_path: Path) -> Path:
    """Three pictures, one in a sub-folder."""
    folder = tmp_path / "images"
    (folder / "more").mkdir(parents=True)
    y, x = np.mgrid[:60, :80]
    for number, name in enumerate(("a.png", "b.jpg", "more/c.png")):
        waves = [np.sin(x / (5 + number + c)) * np.cos(y / (9 + c)) * 90 + 120 + 10 * c for c in range(3)]
        Image.fromarray(np.stack(waves, 2).astype(np.uint8)).save(folder / name)
    return folder


def write(images: Path, out: Path, darkness: DarknessModel = PAPER, **settings) -> writing.Outcome:
    return write_pairs(folder_photos(images), images, out, PairSettings(darkness, **({"size": (40, 60)} | settings)))


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("darkness", [PAPER, VARIED, DarknessModel(quality=(0, 0))])
def test_record_reproduces_the_dark_file_exactly(images: Path, tmp_path: Path, darkness: DarknessModel) -> None:
    write(images, tmp_path / "out", darkness)
    photos = written_photos(tmp_path / "out")
    assert [photo.name for photo in photos] == ["a", "b", "more/c"]
    for photo in photos:
        normal, low = photo.read_normal(), photo.read_low()
        assert normal.shape == (3, 40, 60)
        assert torch.equal(darken(normal, photo.record), low)
        assert photo.record.maximum == normal.max().item()


def test_manifest_holds_names_hashes_and_the_papers_numbers(images: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    write(images, out, quality=80)
    lines = [json.loads(line) for line in (out / "manifest.jsonl").read_text().splitlines()]
    assert [line["source"] for line in lines] == ["a.png", "b.jpg", "more/c.png"]
    for line in lines:
        for key, folder in (("source", images), ("low", out), ("normal", out)):
            assert line[f"{key}_sha256"] == hashlib.sha256((folder / line[key]).read_bytes()).hexdigest()
        assert 3 <= line["gamma"] <= 5
        assert line["A"] == pytest.approx(line["maximum"] ** (1 - line["gamma"]))
        assert line["quality"] == 95
        assert {"seed", "shot", "read", "blur_px", "blur_deg", "cast"} <= line.keys()
    with Image.open(out / "normal/more/c.jpg") as picture:
        assert (picture.format, picture.size) == ("JPEG", (60, 40))


def test_inverting_by_the_manifest_beats_inverting_blindly(images: Path, tmp_path: Path) -> None:
    write(images, tmp_path / "out", DarknessModel(gamma=(3.0, 3.0)))
    for photo in written_photos(tmp_path / "out"):
        normal, low = photo.read_normal(), photo.read_low()
        oracle = (invert_gamma(low, photo.record.gamma, photo.record.maximum) - normal).abs().mean()
        blind = (invert_gamma(low, 4.0) - normal).abs().mean()
        assert oracle < 0.04
        assert oracle < blind / 2


def test_training_reads_the_stored_pair_and_its_record(images: Path, tmp_path: Path) -> None:
    write(images, tmp_path / "out")
    photos = written_photos(tmp_path / "out")
    pairs = WholePairs(PhotoStore(photos, None, 16), DarknessModel(gamma=(1.0, 1.0)))
    for pair, photo in zip((pairs[index] for index in range(3)), photos, strict=True):
        assert torch.equal(pair["low"], read_image(photo.low))
        assert pair["record"] == photo.record


def test_stopped_anywhere_it_goes_on_to_the_same_files(images: Path, tmp_path: Path, monkeypatch) -> None:
    """Cut off while the second pair's dark picture is written, and with a half-written line."""
    write(images, tmp_path / "whole")
    plain = writing.write_image
    calls = []

    def failing(path: Path, *arguments) -> None:
        calls.append(path)
        if len(calls) == 4:
            raise KeyboardInterrupt
        plain(path, *arguments)

    monkeypatch.setattr(writing, "write_image", failing)
    with pytest.raises(KeyboardInterrupt):
        write(images, tmp_path / "cut")
    assert list(read_manifest(tmp_path / "cut")) == ["a"]
    with (tmp_path / "cut/manifest.jsonl").open("a") as manifest:
        manifest.write('{"name": "b", "si')
    outcome = write(images, tmp_path / "cut")
    assert (outcome.written, outcome.kept) == (2, 1)
    assert len(calls) == 4 + 4
    assert contents(tmp_path / "cut") == contents(tmp_path / "whole")


def test_only_what_changed_is_written_again(images: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    write(images, out)
    before = contents(out)
    assert (write(images, out).written, contents(out)) == (0, before)
    (out / "low/a.jpg").write_bytes(b"damaged")
    (out / "normal/more/c.jpg").unlink()
    assert write(images, out).written == 2
    assert contents(out) == before
    Image.fromarray(np.full((60, 80, 3), 99, np.uint8)).save(images / "a.png")
    assert (write(images, out).written, write(images, out).kept) == (1, 3)
    assert read_manifest(out)["a"].source_sha256 == hashlib.sha256((images / "a.png").read_bytes()).hexdigest()
    assert len((out / "manifest.jsonl").read_text().splitlines()) == 3


def test_darkness_depends_on_seed_and_name_alone(images: Path, tmp_path: Path) -> None:
    write(images, tmp_path / "all")
    (images / "a.png").unlink()
    write(images, tmp_path / "fewer")
    write(images, tmp_path / "other", seed=1)
    records = {name: read_manifest(tmp_path / name)["b"].record for name in ("all", "fewer", "other")}
    assert records["all"] == records["fewer"]
    assert records["all"].gamma != records["other"].gamma


def test_unreadable_files_are_listed_and_left_out(images: Path, tmp_path: Path) -> None:
    (images / "text.jpg").write_text("no picture")
    (images / "cut.jpg").write_bytes((images / "b.jpg").read_bytes()[:400])
    outcome = write(images, tmp_path / "out")
    assert outcome.written == 3
    assert [problem.split(":")[0] for problem in outcome.problems] == [str(images / n) for n in ("cut.jpg", "text.jpg")]
    assert set(read_manifest(tmp_path / "out")) == {"a", "b", "more/c"}


class TestRefusals:
    """One sentence, and nothing is touched."""

    def test_folder_with_something_else(self, images: Path, tmp_path: Path) -> None:
        (tmp_path / "out").mkdir()
        (tmp_path / "out/thesis.txt").write_text("dear")
        with pytest.raises(UserError, match="holds something else than a data set"):
            write(images, tmp_path / "out")
        assert contents(tmp_path / "out") == {"thesis.txt": b"dear"}
        with pytest.raises(UserError, match="holds something else than a data set"):
            write(images, tmp_path / "out/thesis.txt")

    def test_out_within_images(self, images: Path) -> None:
        with pytest.raises(UserError, match="its pictures would be darkened again"):
            write(images, images / "dark")
        assert not (images / "dark").exists()

    @pytest.mark.parametrize(
        ("change", "key"),
        [
            ({"seed": 5}, "seed"),
            ({"size": (50, 60)}, "size"),
            ({"quality": 50}, "quality"),
            ({"darkness": VARIED}, "darkness"),
        ],
    )
    def test_other_settings(self, images: Path, tmp_path: Path, change: dict, key: str) -> None:
        write(images, tmp_path / "out")
        before = contents(tmp_path / "out")
        with pytest.raises(UserError, match=f"was written with {key}="):
            write(images, tmp_path / "out", **change)
        assert contents(tmp_path / "out") == before

    @pytest.mark.parametrize(
        ("settings", "key"),
        [({"quality": 0}, "quality"), ({"quality": 90.5}, "quality"), ({"seed": "x"}, "seed")],
    )
    def test_impossible_settings(self, settings: dict, key: str) -> None:
        with pytest.raises(UserError, match=f"{key} must be"):
            PairSettings(PAPER, **settings)

    def test_nothing_usable(self, images: Path, tmp_path: Path) -> None:
        for path in images.rglob("*.*"):
            path.write_text("")
        with pytest.raises(UserError, match="none of 3 photos could be used; the first: "):
            write(images, tmp_path / "out")
