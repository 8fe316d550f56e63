"""KITTI odometry and stereo on miniature trees, and the shared samples where they are."""

from pathlib import Path

import numpy as np
import pytest

from diffnav.data.driving.driving_set import metres_apart
from diffnav.data.driving.headers import check_sizes
from diffnav.data.driving.kitti_odometry import kitti_odometry_drive
from diffnav.data.driving.kitti_stereo import kitti_stereo_scenes
from diffnav.errors import UserError

DRIVING = Path(__file__).parents[4] / "shared" / "data" / "driving"
shared = pytest.mark.skipif(not DRIVING.is_dir(), reason="needs the shared images beside the repository")


def pictures(folder: str, numbers: list[int]) -> list[str]:
    return [f"{folder}/{number:06d}.png" for number in numbers]


def pose(x: float, y: float, z: float) -> str:
    return f"1 0 0 {x} 0 1 0 {y} 0 0 1 {z}\n"


class TestOdometry:
    def test_one_sequence_with_poses_beside(self, grow, write) -> None:
        root = grow(*pictures("image_0", [0, 1, 2, 3]), *pictures("image_1", [0, 2, 3, 4]))
        write("poses.txt", "".join(pose(0, -k, 1.2 * k) for k in range(4)))
        # Times that jitter pair nothing: names do.
        write("times.txt", "0.0\n1.036e-01\n0.2\n")
        drive = kitti_odometry_drive(root)
        assert [(q.name, q.record, q.camera) for q in drive.queries] == [
            (f"image_0/00000{k}", "my data", "image_0") for k in (0, 2, 3)
        ]
        assert [r.name for r in drive.references] == [f"image_1/00000{k}" for k in (0, 2, 3)]
        assert [q.index for q in drive.queries] == [0, 2, 3]
        assert [q.position_m for q in drive.queries] == [(0, 0, 0), (0, -2, 2.4), (0, -3, pytest.approx(3.6))]
        assert [q.time_s for q in drive.queries] == [0.0, 0.2, None]
        assert [sentence.split(":")[0] for sentence in drive.unmatched] == ["image_0/000001", "image_1/000004"]
        assert drive.consecutive

    def test_the_whole_data_set(self, grow, write) -> None:
        root = grow(
            *pictures("sequences/00/image_2", [0, 1]), *pictures("sequences/00/image_3", [0, 1]),
            *pictures("sequences/00/image_0", [0]), *pictures("sequences/00/image_1", [0]),
            *pictures("sequences/07/image_0", [0]), *pictures("sequences/07/image_1", [0]),
        )  # fmt: skip
        write("poses/00.txt", pose(1, 2, 3) + pose(4, 5, 6))
        drive = kitti_odometry_drive(root)
        assert [(q.record, q.camera, q.position_m) for q in drive.queries] == [
            ("00", "image_2", (1, 2, 3)), ("00", "image_2", (4, 5, 6)), ("07", "image_0", None),
        ]  # fmt: skip
        assert drive.notes == ["07: no positions"]
        grey = kitti_odometry_drive(root, sequences=["00"], cameras=["image_1", "image_0"])
        assert [(q.name, q.camera) for q in grey.queries] == [("sequences/00/image_1/000000", "image_1")]
        # A sequence given by itself finds its poses where the data set keeps them.
        assert kitti_odometry_drive(root / "sequences/00").queries[1].position_m == (4, 5, 6)

    def test_mistakes_are_one_sentence(self, grow, write, tmp_path: Path) -> None:
        root = grow(*pictures("image_0", [0]), *pictures("image_3", [0]))
        with pytest.raises(UserError, match=r"no folder .*image_[12]: KITTI odometry is sequences/NN/image_0"):
            kitti_odometry_drive(root)
        with pytest.raises(UserError, match="must be two folders, of queries and of references, got"):
            kitti_odometry_drive(root, cameras=["image_0"])
        with pytest.raises(UserError, match=r"data\.sequences must be null"):
            kitti_odometry_drive(root, sequences=["00"])
        with pytest.raises(UserError, match=r"no folder .*nowhere: KITTI odometry is"):
            kitti_odometry_drive(tmp_path / "nowhere")
        grow(*pictures("image_1", [0]))
        write("poses.txt", pose(1, 2, 3) + "1 2 3\n")
        with pytest.raises(UserError, match=r"poses\.txt line 2: a pose has 12 numbers, found 3"):
            kitti_odometry_drive(root)
        (root / "sequences/03").mkdir(parents=True)
        for names in (None, ["03"], ["04"]):
            with pytest.raises(UserError, match=r"no pictures in .*sequences.*: KITTI odometry is"):
                kitti_odometry_drive(root, sequences=names)

    def test_the_folder_one_is_in_has_a_name(self, grow, monkeypatch) -> None:
        monkeypatch.chdir(grow(*pictures("image_0", [0]), *pictures("image_1", [0])))
        assert kitti_odometry_drive(".").counts == {"my data": 1}

    def test_nothing_in_common(self, grow) -> None:
        root = grow(*pictures("image_0", [0]), *pictures("image_1", [1]))
        with pytest.raises(UserError, match="kitti_odometry: no picture has a partner"):
            kitti_odometry_drive(root)


class TestStereo:
    def test_single_scenes_without_their_successors(self, grow) -> None:
        names = [f"0000{k}_{n}.png" for k in ("02", "10") for n in (10, 11)]
        root = grow(*(f"training/image_{c}/{name}" for c in (2, 3) for name in names), "training/image_3/000003_10.png")
        for where in (root, root / "training"):
            drive = kitti_stereo_scenes(where)
            assert [q.name for q in drive.queries] == ["image_2/000002_10", "image_2/000010_10"]
            assert [r.name for r in drive.references] == ["image_3/000002_10", "image_3/000010_10"]
            assert not drive.consecutive
            assert drive.notes == ["4 pictures NNNNNN_11, a tenth of a second later, are passed over"]
            assert [sentence.split(":")[0] for sentence in drive.unmatched] == ["image_3/000003_10"]

    def test_missing_folders_describe_the_tree(self, grow, tmp_path: Path) -> None:
        with pytest.raises(UserError, match=r"no folder .*nowhere: KITTI stereo 2015 is"):
            kitti_stereo_scenes(tmp_path / "nowhere")
        with pytest.raises(UserError, match=r"no folder .*image_3: KITTI stereo 2015 is"):
            kitti_stereo_scenes(grow("image_2/000000_10.png"))


@shared
@pytest.mark.parametrize(
    ("name", "cameras", "pairs", "grey"), [("kitti_odom_1", (0, 1), 51, 51), ("kitti_odom_3_colour", (2, 3), 14, 0)]
)
def test_shared_drives(name: str, cameras: tuple[int, int], pairs: int, grey: int) -> None:
    drive = kitti_odometry_drive(DRIVING / name)
    assert drive.counts == {name: pairs}
    assert drive.unmatched == []
    assert [q.camera for q in drive.queries] == [f"image_{cameras[0]}"] * pairs
    assert [r.camera for r in drive.references] == [f"image_{cameras[1]}"] * pairs
    assert [q.index for q in drive.queries] == list(range(pairs))
    assert len(check_sizes(drive)) == (grey > 0)
    first = drive.queries[0].read()
    assert first.shape == drive.references[0].read().shape
    assert bool((first[0] == first[1]).all()) == (grey > 0)
    if name == "kitti_odom_1":
        steps = [metres_apart(a, b) for a, b in zip(drive.queries, drive.queries[1:], strict=False)]
        assert np.median(steps) == pytest.approx(1.2, abs=0.2)
    else:
        assert {q.position_m for q in drive.queries} == {None}
        assert drive.queries[13].time_s == pytest.approx(1.35, abs=0.1)


@shared
def test_shared_scenes() -> None:
    drive = kitti_stereo_scenes(DRIVING / "kitti_stereo2015")
    assert (len(drive), drive.unmatched, drive.consecutive) == (50, [], False)
    assert drive.queries[0].moment == drive.references[0].moment == "000002"
    assert check_sizes(drive) == []
