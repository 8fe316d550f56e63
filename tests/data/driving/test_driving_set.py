"""What a driving set tells of its frames: reading, distances in frames and metres, thinning, leaving out."""

import math
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from diffnav.data.driving.driving_set import DrivingSet, Frame, frames_apart, metres_apart
from diffnav.data.driving.pairing import pair_frames
from diffnav.errors import UserError


def frame(record: str, moment: int, camera: str = "left", **fields) -> Frame:
    name = f"{camera}/{record}/{moment}"
    return Frame(name, Path(name), camera, record, str(moment), **fields)


def drive(moments: dict[str, list[int]]) -> DrivingSet:
    sides = [[frame(record, k, camera) for record, ks in moments.items() for k in ks] for camera in ("left", "right")]
    return pair_frames("a drive", *sides, consecutive=True)


def test_a_frame_reads_a_file_or_renders(tmp_path: Path) -> None:
    Image.fromarray(np.full((4, 6), 51, np.uint8)).save(tmp_path / "grey.png")
    grey = Frame("grey", tmp_path / "grey.png", "left", "drive", "0")
    # Grey becomes three equal channels: 51 of 255 is a fifth.
    assert torch.equal(grey.read(), torch.full((3, 4, 6), 51 / 255))
    rendered = Frame("made", lambda: torch.ones(3, 2, 2), "left", "drive", "0")
    assert torch.equal(rendered.read(), torch.ones(3, 2, 2))
    for one in (grey, rendered):
        photo = one.photo()
        assert (photo.name, photo.site) == (one.name, "drive")
        assert torch.equal(photo.read_normal(), one.read())


def test_truncated_pictures_are_one_sentence_when_read(tmp_path: Path) -> None:
    file = tmp_path / "half.png"
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (64, 64, 3), np.uint8)).save(file)
    file.write_bytes(file.read_bytes()[:4000])
    with pytest.raises(UserError, match=r"half\.png: damaged image"):
        Frame("half", file, "left", "drive", "0").read()


def test_a_larger_picture_is_shrunk_by_its_longest_side() -> None:
    dice = torch.Generator().manual_seed(0)
    picture = torch.rand(3, 80, 128, generator=dice)
    for made in (picture, picture.transpose(1, 2)):
        one = Frame("made", lambda made=made: made, "left", "drive", "0")
        for side in (None, 128, 500):
            assert torch.equal(one.read(side), made)
        # Half the size: the mean of each 2 x 2 pixels.
        height, width = made.shape[1] // 2, made.shape[2] // 2
        means = made.reshape(3, height, 2, width, 2).mean((2, 4))
        assert torch.allclose(one.read(64), means, atol=1e-6)
        assert torch.equal(one.photo(64).read_normal(), one.read(64))
    narrow = Frame("narrow", lambda: torch.ones(3, 1000, 2), "left", "drive", "0")
    assert narrow.read(100).shape == (3, 100, 1)


def test_distance_in_frames_counts_within_a_record() -> None:
    a, b, other = frame("a", 1, index=3), frame("a", 9, index=5), frame("b", 1, index=3)
    assert (frames_apart(a, a), frames_apart(a, b), frames_apart(b, a)) == (0, 2, 2)
    assert frames_apart(a, other) == math.inf


def test_distance_in_metres_needs_positions_of_one_world() -> None:
    a = frame("a", 1, position_m=(1.0, 2.0, 3.0), world="map")
    b = frame("b", 1, position_m=(1.0, 5.0, 7.0), world="map")
    assert metres_apart(a, b) == 5.0
    assert metres_apart(a, frame("b", 1, position_m=(1.0, 5.0, 7.0), world="another")) == math.inf
    assert metres_apart(a, frame("a", 2)) is None
    assert metres_apart(frame("a", 2), a) is None


def test_thinning_keeps_partners_and_counts_in_its_steps() -> None:
    every = drive({"a": list(range(7)), "b": list(range(4))}).every(3)
    assert [(q.record, q.moment, q.index) for q in every.queries] == [
        ("a", "0", 0), ("a", "3", 1), ("a", "6", 2), ("b", "0", 0), ("b", "3", 1),
    ]  # fmt: skip
    assert every.truth == [0, 1, 2, 3, 4]
    assert [(r.record, r.moment, r.index) for r in every.references] == [
        (q.record, q.moment, q.index) for q in every.queries
    ]
    assert every.counts == {"a": 3, "b": 2}
    assert every.notes == ["one moment in 3 of each record"]


def test_thinning_follows_the_truth_wherever_it_points() -> None:
    straight = drive({"a": [0, 1, 2, 3]})
    turned = DrivingSet("turned", straight.queries, straight.references[::-1], [3, 2, 1, 0], True, [], [])
    every = turned.every(2)
    assert [every.references[place].moment for place in every.truth] == ["0", "2"]
    assert turned.every(1) == turned


def test_thinning_refuses_what_leaves_nothing() -> None:
    with pytest.raises(UserError, match="1 or more, got 0"):
        drive({"a": [0, 1]}).every(0)
    # The only pair is the second moment.
    sides = [[frame("a", 0), frame("a", 1)], [frame("a", 1, "right")]]
    with pytest.raises(UserError, match="no pair is left at a step of 2"):
        pair_frames("a drive", *sides, consecutive=True).every(2)


def test_without_some_references_their_queries_go_too() -> None:
    whole = drive({"a": [0, 1, 2], "b": [0]})
    left = whole.without({1: "right/a/1: damaged", 3: "right/b/0: no such file"})
    assert [(q.record, q.moment, q.index) for q in left.queries] == [("a", "0", 0), ("a", "2", 2)]
    # Neighbours are still those of the drive: a moment lies between these two.
    assert frames_apart(*left.references) == 2
    assert left.truth == [0, 1]
    assert left.counts == {"a": 2}
    assert left.unmatched == [
        "right/a/1: damaged; its pair is left out",
        "right/b/0: no such file; its pair is left out",
    ]
    assert whole.without({}) == whole
    # One after the other.
    assert left.without({0: "gone"}).queries == whole.queries[2:3]


def test_without_follows_the_truth_wherever_it_points() -> None:
    straight = drive({"a": [0, 1, 2, 3]})
    turned = DrivingSet("turned", straight.queries, straight.references[::-1], [3, 2, 1, 0], True, ["before"], ["note"])
    left = turned.without({2: "gone"})
    assert [q.moment for q in left.queries] == ["0", "2", "3"]
    assert [left.references[place].moment for place in left.truth] == ["0", "2", "3"]
    assert (left.unmatched, left.notes) == (["before", "gone; its pair is left out"], ["note"])


def test_without_all_references_nothing_is_left() -> None:
    with pytest.raises(UserError, match="a drive: no pair is left; right/a/0: damaged"):
        drive({"a": [0, 1]}).without({0: "right/a/0: damaged", 1: "right/a/1: damaged"})
