"""4Seasons: recordings with both kinds of position files, jitter between the cameras, damaged files."""

from pathlib import Path

import pytest

from diffnav.data.driving.four_seasons import four_seasons_drive
from diffnav.data.driving.poses import four_seasons_times, four_seasons_track, position_at
from diffnav.errors import UserError

START = 1_602_074_967_051_661_568
TICK = 33_333_333
STAMPS = [START + k * TICK for k in range(4)]


def recording(grow, left: list[int], right: list[int], name: str = "recording 1") -> Path:
    base = f"{name}/undistorted_images"
    return grow(*(f"{base}/cam0/{ns}.png" for ns in left), *(f"{base}/cam1/{ns}.png" for ns in right)) / name


def test_pairs_by_name_positions_between_key_frames(grow, write) -> None:
    root = recording(grow, STAMPS, [STAMPS[0], *STAMPS[2:]])
    # Key frames 0 and 3, in metres after the scale of 2; comments as in the published files.
    write(
        "recording 1/GNSSPoses.txt",
        "# frame_id, t, q, scale, fusion_quality, v3\n"
        f"{STAMPS[0]},1,2,3,0,0,0,1,2.0,2,0\n{STAMPS[3]},4,2,-3,0,0,0,1,2.0,2,0\n",
    )
    write("recording 1/result.txt", f"{STAMPS[0] * 1e-9:.9f} 9 9 9 0 0 0 1\n")
    write("recording 1/times.txt", "".join(f"{ns} {ns * 1e-9:.9f} 5.0\n" for ns in STAMPS))
    drive = four_seasons_drive(root)
    assert [q.moment for q in drive.queries] == [str(STAMPS[k]) for k in (0, 2, 3)]
    assert [q.index for q in drive.queries] == [0, 2, 3]
    assert drive.unmatched == [
        f"undistorted_images/cam0/{STAMPS[1]}: no reference in record recording 1 named {STAMPS[1]}; left out"
    ]
    # Two thirds of the way from (2, 4, 6) to (8, 4, -6).
    assert [q.position_m for q in drive.queries] == [
        pytest.approx(p, abs=1e-3) for p in ((2, 4, 6), (6, 4, -2), (8, 4, -6))
    ]
    assert drive.references[1].position_m == drive.queries[1].position_m
    assert drive.queries[1].time_s - drive.queries[0].time_s == pytest.approx(2 / 30, abs=1e-6)
    assert drive.notes == ["recording 1: positions of GNSSPoses.txt"]
    assert drive.consecutive


def test_jittered_names_need_a_tolerance(grow) -> None:
    root = recording(grow, STAMPS[:2], [STAMPS[0], STAMPS[1] + 900_000])
    assert len(four_seasons_drive(root)) == 1
    drive = four_seasons_drive(root, tolerance_s=0.001)
    assert [r.moment for r in drive.references] == [str(STAMPS[0]), str(STAMPS[1] + 900_000)]
    assert len(four_seasons_drive(root, tolerance_s=0.0005)) == 1


def test_several_recordings_have_worlds_of_their_own(grow, write) -> None:
    recording(grow, STAMPS[:1], STAMPS[:1], "b")
    root = recording(grow, STAMPS[:1], STAMPS[:1], "a").parent
    write("a/result.txt", f"{STAMPS[0] * 1e-9:.6f} 1 2 3 0 0 0 1\n")
    drive = four_seasons_drive(root)
    assert [(q.record, q.world, q.position_m) for q in drive.queries] == [("a", "a", (1, 2, 3)), ("b", "b", None)]
    assert len({q.name for q in drive.queries}) == 2
    assert drive.notes == ["a: positions of result.txt", "b: no positions"]


def test_no_position_is_invented() -> None:
    track = [(0.0, (0.0, 0.0, 0.0)), (1.0, (2.0, 4.0, 6.0)), (9.0, (0.0, 0.0, 0.0))]
    assert position_at(track, 0.25) == (0.5, 1.0, 1.5)
    assert position_at(track, 1.0) == (2.0, 4.0, 6.0)
    assert position_at(track, 9.0) == (0.0, 0.0, 0.0)
    # Before, after, and in a gap of 8 s.
    assert [position_at(track, time) for time in (-0.1, 9.1, 5.0)] == [None] * 3
    assert position_at([], 1.0) is None


def test_files_in_their_forms_and_damaged(write) -> None:
    assert four_seasons_times(write("times.txt", f"{START} 1602074967.05 4.1\n\n{START + 1}\n")) == {
        str(START): 1602074967.05,
        str(START + 1): pytest.approx((START + 1) * 1e-9),
    }
    unsorted = write("track.txt", "2.5 1 2 3 0 0 0 1\n1.5 4 5 6 0 0 0 1\n")
    assert four_seasons_track(unsorted) == [(1.5, (4, 5, 6)), (2.5, (1, 2, 3))]
    with pytest.raises(UserError, match=r"track\.txt line 2: a pose has 8 numbers or more, found 3"):
        four_seasons_track(write("track.txt", "2.5 1 2 3 0 0 0 1\n1.5 4 5\n"))
    with pytest.raises(UserError, match=r"times\.txt line 1: not numbers \(frame time\)"):
        four_seasons_times(write("times.txt", "frame time\n"))


def test_missing_folders_describe_the_tree(grow, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no folder .*undistorted_images: a recording of 4Seasons is"):
        four_seasons_drive(tmp_path)
    root = grow(f"undistorted_images/cam0/{START}.png")
    with pytest.raises(UserError, match=r"no folder .*cam1: a recording of 4Seasons is"):
        four_seasons_drive(root)
