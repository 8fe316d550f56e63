"""References that are kept: when they are read again, and when they are not."""

import hashlib
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from driving_stubs import gms, noise_drive, read_all, same_references, view
from torch import Tensor

from diffnav.data.driving.driving_set import DrivingSet, Frame
from diffnav.errors import UserError
from diffnav.evaluation.driving.references import picture_key
from diffnav.images import write_image


@pytest.fixture
def drive(tmp_path: Path) -> DrivingSet:
    """Three pairs in files."""
    return noise_drive(3, tmp_path / "drive")


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the frames whose pictures are read."""
    names: list[str] = []
    whole: Callable[..., Tensor] = Frame.read

    def noted(frame: Frame, longest_side: int | None = None) -> Tensor:
        names.append(frame.name)
        return whole(frame, longest_side)

    monkeypatch.setattr(Frame, "read", noted)
    return names


def test_the_second_time_no_picture_is_read(drive: DrivingSet, tmp_path: Path, reads: list[str]) -> None:
    first = read_all(drive, tmp_path / "cache")
    assert reads == ["right/0", "right/1", "right/2"]
    assert same_references(read_all(drive, tmp_path / "cache"), first)
    # The picture counts, not its name or place.
    moved = [replace(one, name=f"new/{one.moment}") for one in drive.references]
    for one in moved:
        (tmp_path / "elsewhere").mkdir(exist_ok=True)
        shutil.copy(str(one.picture), tmp_path / "elsewhere")
    again = [replace(one, picture=tmp_path / "elsewhere" / Path(str(one.picture)).name) for one in moved]
    assert same_references(read_all(replace(drive, references=again), tmp_path / "cache"), first)
    assert len(reads) == 3
    # Without a cache it is read again.
    assert same_references(read_all(drive, None), first)
    assert len(reads) == 6


def test_rendered_pictures_are_kept_too(tmp_path: Path, reads: list[str]) -> None:
    first = read_all(noise_drive(2), tmp_path / "cache")
    assert same_references(read_all(noise_drive(3), tmp_path / "cache")[:2], first)
    assert reads == ["right/0", "right/1", "right/2"]


def test_what_decides_the_features_decides_whether_they_are_read_again(
    drive: DrivingSet, tmp_path: Path, reads: list[str]
) -> None:
    cache = tmp_path / "cache"
    whole = read_all(drive, cache)
    few = read_all(drive, cache, gms(features=20))
    small = read_all(drive, cache, longest_side=128)
    assert len(reads) == 9
    assert len(few[0].features["orb_gms"]) <= 20 < len(whole[0].features["orb_gms"])
    assert [one.size for one in small] == [(77, 128)] * 3
    # One picture changed.
    write_image(Path(str(drive.references[1].picture)), view(300))
    changed = read_all(drive, cache)
    assert reads[9:] == ["right/1"]
    assert same_references([changed[0], changed[2]], [whole[0], whole[2]])
    assert not same_references(changed, whole)


@pytest.mark.parametrize("damage", [b"", b"nothing of the kind", b"PK\x03\x04 but no archive", "cut", "changed"])
def test_a_damaged_file_of_the_cache_is_made_anew(
    damage: bytes | str, drive: DrivingSet, tmp_path: Path, reads: list[str]
) -> None:
    first = read_all(drive, tmp_path / "cache")
    files = sorted((tmp_path / "cache").rglob("*.npz"))
    assert len(files) == 3
    content = files[0].read_bytes()
    middle = len(content) // 2
    changed = bytes(255 - byte for byte in content[middle : middle + 400])
    spoilt = {"cut": content[:middle], "changed": content[:middle] + changed + content[middle + 400 :]}
    files[0].write_bytes(damage if isinstance(damage, bytes) else spoilt[damage])
    assert same_references(read_all(drive, tmp_path / "cache"), first)
    assert len(reads) == 4
    assert same_references(read_all(drive, tmp_path / "cache"), first)
    assert len(reads) == 4
    assert not list((tmp_path / "cache").rglob("*.part"))


def test_a_cache_that_cannot_be_written(drive: DrivingSet, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"cannot be written .*; choose another cache="):
        read_all(drive, tmp_path / "file" / "cache")


def test_a_pictures_key_is_of_what_it_shows(drive: DrivingSet) -> None:
    frame, other = drive.references[:2]
    digest = hashlib.sha256(Path(str(frame.picture)).read_bytes()).hexdigest()
    assert digest in picture_key(frame, None)
    rendered = noise_drive(2).references
    keys = {picture_key(one, side) for one in (frame, other, *rendered) for side in (None, 64)}
    assert len(keys) == 8
    assert picture_key(noise_drive(5).references[1], 64) == picture_key(rendered[1], 64)
    # A file that is gone has a key, for its failure has a record.
    gone = Frame("gone", Path("/nowhere.png"), "left", "road", "0")
    assert picture_key(gone, None) == picture_key(gone, None) != picture_key(replace(gone, picture=Path("/b")), None)
