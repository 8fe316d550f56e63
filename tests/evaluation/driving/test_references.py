"""References read once: what is kept of them, when they are read again, and which cannot be used."""

from pathlib import Path

import numpy as np
import pytest
import torch
from driving_stubs import SIZE, gms, noise_drive, read_all, same_references, view
from torch import Tensor

from diffnav.data.driving.driving_set import DrivingSet
from diffnav.driving.shortlist import picture_descriptor
from diffnav.errors import UserError
from diffnav.evaluation.contest import NamedMatcher
from diffnav.evaluation.driving.references import ReferenceReader, read_references
from diffnav.images import read_image, write_image
from diffnav.matching.matches import Features, Matches
from diffnav.matching.orb import Orb


@pytest.fixture
def drive(tmp_path: Path) -> DrivingSet:
    """Three pairs in files."""
    return noise_drive(3, tmp_path / "drive")


def test_what_is_known_of_a_reference(drive: DrivingSet) -> None:
    orb = NamedMatcher("orb", Orb(features=30))
    found = read_all(drive, None, gms(), orb)
    assert len(found) == 3
    for frame, one in zip(drive.references, found, strict=True):
        picture = read_image(Path(str(frame.picture)))
        assert (one.size, one.grey, one.problem) == (SIZE, False, None)
        assert np.array_equal(one.descriptor, picture_descriptor(picture))
        assert list(one.features) == ["orb_gms", "orb"]
        for named in (gms(), orb):
            expected, own = named.matcher.features(picture), one.features[named.name]
            assert own.size == SIZE
            for part in ("keypoints", "descriptors", "scores"):
                assert torch.equal(getattr(own, part), getattr(expected, part))
    assert len(found[0].features["orb_gms"]) > 30 >= len(found[0].features["orb"]) > 0


def test_processes_find_what_one_finds(drive: DrivingSet, tmp_path: Path) -> None:
    alone = read_all(drive, None)
    assert same_references(read_all(drive, tmp_path / "cache", workers=2), alone)
    assert same_references(read_all(drive, tmp_path / "cache"), alone)


def test_a_truncated_picture_leaves_its_pair_out(drive: DrivingSet, tmp_path: Path) -> None:
    broken = Path(str(drive.references[1].picture))
    broken.write_bytes(broken.read_bytes()[:3000])
    for _ in range(2):
        left, found = read_references(drive, ReferenceReader([gms()], None, tmp_path / "cache"))
        assert [one.name for one in left.references] == ["right/0", "right/2"]
        assert [one.name for one in left.queries] == ["left/0", "left/2"]
        assert left.truth == [0, 1]
        assert same_references(found, [one for k, one in enumerate(read_all(noise_drive(3), None)) if k != 1])
        (sentence,) = left.unmatched
        assert sentence.startswith(f"{broken}: damaged image")
        assert sentence.endswith("its pair is left out")
        assert "\n" not in sentence


def test_a_picture_that_is_gone_leaves_its_pair_out(drive: DrivingSet) -> None:
    Path(str(drive.references[2].picture)).unlink()
    left, found = read_references(drive, ReferenceReader([gms()], None, None))
    assert (len(left), len(found)) == (2, 2)
    assert left.unmatched == [f"{drive.references[2].picture}: no such file; its pair is left out"]


def test_without_any_picture_nothing_is_left(drive: DrivingSet) -> None:
    for frame in drive.references:
        Path(str(frame.picture)).write_bytes(b"no picture")
    with pytest.raises(UserError, match=r"noise: no pair is left; .*0\.png: not an image that can be read"):
        read_all(drive, None)


def test_pictures_of_different_sizes_and_kinds(drive: DrivingSet, tmp_path: Path) -> None:
    write_image(Path(str(drive.references[0].picture)), view(0)[:, :80, :120])
    write_image(Path(str(drive.references[1].picture)), view(24).mean(0, keepdim=True).expand(3, -1, -1))
    for _ in range(2):
        found = read_all(drive, tmp_path / "cache")
        assert [one.size for one in found] == [(80, 120), SIZE, SIZE]
        assert [one.features["orb_gms"].size for one in found] == [(80, 120), SIZE, SIZE]
        assert [one.grey for one in found] == [False, True, False]


class Whole:
    """A matcher that has no keypoints."""

    name, settings = "whole", {}

    def features(self, image: Tensor) -> Features:
        nothing = torch.zeros(0, 2)
        return Features(nothing, nothing, torch.zeros(0), (image.shape[1], image.shape[2]), image)

    def match(self, a: Features, b: Features) -> Matches:
        raise NotImplementedError


def test_a_matcher_without_keypoints_is_refused(drive: DrivingSet, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="matchers=whole has no keypoints that could be kept; use another"):
        read_all(drive, tmp_path / "cache", NamedMatcher("whole", Whole()))
