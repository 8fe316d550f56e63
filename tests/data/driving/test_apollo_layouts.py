"""ApolloScape's three layouts on miniature trees, and their pose files in both forms."""

from pathlib import Path

import pytest

from diffnav.data.driving.apollo_roads import OFFSET, apollo_roads_drive
from diffnav.data.driving.apollo_stereo import apollo_stereo_drive
from diffnav.data.driving.driving_set import metres_apart
from diffnav.data.driving.zpark import zpark_drive
from diffnav.errors import UserError

FIRST, SECOND, THIRD = "170427_222949943", "170427_222950143", "170427_222950343"
JITTERED = "170427_222950146"


def zpark(grow, write, images="image", poses="pose", lists="trainval_split") -> Path:
    """Record001: two pairs, the third lost its partner to a jitter; Record002: one pair, and a dropped picture."""
    pictures = [
        *(f"Record001/Camera_1/{stamp}_Camera_1" for stamp in (FIRST, SECOND, THIRD)),
        *(f"Record001/Camera_2/{stamp}_Camera_2" for stamp in (FIRST, JITTERED, THIRD)),
        *(f"Record002/Camera_1/{stamp}_Camera_1" for stamp in (FIRST, SECOND)),
        f"Record002/Camera_2/{SECOND}_Camera_2",
    ]
    root = grow(*(f"{images}/{name}.jpg" for name in pictures))
    write(f"{lists}/train.txt", "\n".join(reversed(pictures)) + "\n")
    lines = "{0}_Camera_{2}.jpg 0.1,0.2,0.3,{1},40.5,2\n"
    write(f"{poses}/Record001/Camera_1.txt", lines.format(FIRST, 100, 1) + lines.format(THIRD, 103, 1))
    write(f"{poses}/Record001/Camera_2.txt", lines.format(FIRST, 100.5, 2) + lines.format(THIRD, 103.5, 2))
    return root


class TestZpark:
    @pytest.mark.parametrize("names", [(), ("images", "camera_pose", "split")])
    def test_the_list_pairs_by_the_first_two_parts(self, grow, write, names) -> None:
        drive = zpark_drive(zpark(grow, write, *names))
        assert [(q.record, q.moment, q.index) for q in drive.queries] == [
            ("Record001", FIRST, 0), ("Record001", THIRD, 3), ("Record002", SECOND, 1),
        ]  # fmt: skip
        assert drive.queries[0].name == f"Record001/Camera_1/{FIRST}_Camera_1"
        assert drive.references[0].name == f"Record001/Camera_2/{FIRST}_Camera_2"
        assert drive.truth == [0, 1, 2]
        assert drive.counts == {"Record001": 2, "Record002": 1}
        assert drive.consecutive
        assert [sentence.split(":")[0] for sentence in drive.unmatched] == [
            f"Record001/Camera_1/{SECOND}_Camera_1",
            f"Record001/Camera_2/{JITTERED}_Camera_2",
            f"Record002/Camera_1/{FIRST}_Camera_1",
        ]
        assert drive.notes == ["3 pairs, where the paper has 1121: the numbers do not compare"]

    def test_positions_and_times(self, grow, write) -> None:
        drive = zpark_drive(zpark(grow, write))
        assert [q.position_m for q in drive.queries] == [(100, 40.5, 2), (103, 40.5, 2), None]
        assert metres_apart(drive.queries[1], drive.references[0]) == 2.5
        # 22:29:49.943 to 22:29:50.343.
        assert drive.queries[1].time_s - drive.queries[0].time_s == pytest.approx(0.4, abs=1e-6)

    def test_what_the_list_leaves_out_stays_out(self, grow, write) -> None:
        root = zpark(grow, write)
        write("trainval_split/val.txt", "".join(f"Record001/Camera_{k}/{THIRD}_Camera_{k}.jpg\n" for k in (1, 2)))
        drive = zpark_drive(root, part="val")
        assert ([q.moment for q in drive.queries], drive.unmatched, drive.notes) == ([THIRD], [], [])
        assert len(zpark_drive(root, part=None)) == 3

    def test_cameras_may_be_exchanged_and_jitter_allowed(self, grow, write) -> None:
        drive = zpark_drive(zpark(grow, write), query_camera=2, reference_camera=1, tolerance_s=0.01)
        assert [q.moment for q in drive.queries] == [FIRST, JITTERED, THIRD, SECOND]
        assert {q.camera for q in drive.queries} == {"Camera_2"}
        assert drive.references[1].moment == SECOND

    def test_mistakes_describe_the_tree(self, grow, write, tmp_path: Path) -> None:
        with pytest.raises(UserError, match=r"no folder .*image: zpark is image/RecordNNN/Camera_1 and Camera_2"):
            zpark_drive(tmp_path)
        root = zpark(grow, write)
        with pytest.raises(UserError, match=r"no list .*train2\.txt: zpark is"):
            zpark_drive(root, part="train2")
        (root / f"image/Record002/Camera_2/{SECOND}_Camera_2.jpg").unlink()
        with pytest.raises(UserError, match=rf"train\.txt names pictures .* 1 of 9, e\.g\. .*{SECOND}_Camera_2\.jpg"):
            zpark_drive(root)
        with pytest.raises(UserError, match=r"no folder of camera 3 below .*image: zpark is"):
            zpark_drive(root, reference_camera=3)
        with pytest.raises(UserError, match="are both 1; name two cameras"):
            zpark_drive(root, reference_camera=1)


class TestStereo:
    def test_parts_blanks_and_strays(self, grow) -> None:
        root = grow(
            *(f"part 1/camera_5/{stamp}_Camera_5.jpg" for stamp in (FIRST, SECOND)),
            *(f"part 1/camera_6/{stamp}_Camera_6.jpg" for stamp in (SECOND, THIRD)),
            "part 1/camera_5/preview.jpg",
            f"part 2/Camera 5/{FIRST}_Camera_5.jpg",
            f"part 2/Camera 6/{FIRST}_Camera_6.jpg",
            f"part 3/camera_5/{FIRST}_Camera_5.jpg",
            f"part 1/camera_56/{FIRST}_Camera_6.jpg",
        )
        drive = apollo_stereo_drive(root)
        assert [(q.record, q.moment) for q in drive.queries] == [("part 1", SECOND), ("part 2", FIRST)]
        assert not drive.consecutive
        assert drive.unmatched == [
            f"{root}/part 3/camera_5: no folder of camera 6 beside it; left out",
            f"{root}/part 1/camera_5/preview.jpg: its name is not {{date}}_{{time}}_{{camera}}; left out",
            f"part 1/camera_5/{FIRST}_Camera_5: no reference in record part 1 named {FIRST}; left out",
            f"part 1/camera_6/{THIRD}_Camera_6: no query in record part 1 named {THIRD}; left out",
        ]
        assert [q.record for q in apollo_stereo_drive(root / "part 2").queries] == ["part 2"]

    def test_a_jittered_stamp_needs_a_tolerance(self, grow) -> None:
        root = grow(f"camera_5/{SECOND}_Camera_5.jpg", f"camera_6/{JITTERED}_Camera_6.jpg")
        with pytest.raises(UserError, match="no picture has a partner"):
            apollo_stereo_drive(root)
        with pytest.raises(UserError, match="no picture has a partner"):
            apollo_stereo_drive(root, tolerance_s=0.002)
        assert len(apollo_stereo_drive(root, tolerance_s=0.003)) == 1

    def test_a_missing_camera_describes_the_tree(self, grow) -> None:
        root = grow(f"camera_5/{FIRST}_Camera_5.jpg")
        with pytest.raises(UserError, match=r"no folder of camera 6 below .*my data: ApolloScape stereo is folders"):
            apollo_stereo_drive(root)
        grow(f"elsewhere/camera_6/{FIRST}_Camera_6.jpg")
        with pytest.raises(UserError, match="no folder that holds both camera 5 and 6 below"):
            apollo_stereo_drive(root)
        grow(f"Camera_5/{FIRST}_Camera_5.jpg")
        with pytest.raises(UserError, match=r"holds camera 5 twice \(Camera_5, camera_5\)"):
            apollo_stereo_drive(root)


class TestRoads:
    def road(self, grow, write, road: str, five: str, six: str, stamps: tuple[str, ...] = (FIRST, SECOND)) -> Path:
        record = "BJ20170901A/Record014"
        for camera, x in ((five, 10.0), (six, 10.8)):
            tail = camera.replace(" ", "_")
            grow(*(f"Train/{road}/image/{record}/{camera}/{stamp}_{tail}.jpg" for stamp in stamps))
            write(
                f"Train/{road}/pose/{record}/{camera}.txt",
                "".join(f"{stamp}_{tail}.jpg -1.4,0.0,2.9,{x + k},3645.2,38.6\n" for k, stamp in enumerate(stamps)),
            )
        return write("Test/readme.txt", "").parents[1]

    def test_records_of_several_roads(self, grow, write) -> None:
        self.road(grow, write, "Road11", "Camera 5", "Camera 6")
        root = self.road(grow, write, "Road2", "Camera_5", "Camera_6", (THIRD,))
        grow(f"Train/Road11/image/BJ20170901A/Record014/Camera 6/{THIRD}_Camera_6.jpg")
        grow(f"Train/Road11/image/BJ20170901A/Record015/Camera 6/{FIRST}_Camera_6.jpg")
        drive = apollo_roads_drive(root)
        assert [(q.record.split("/")[0], q.moment) for q in drive.queries] == [
            ("Road2", THIRD), ("Road11", FIRST), ("Road11", SECOND),
        ]  # fmt: skip
        assert drive.queries[1].record == "Road11/BJ20170901A/Record014"
        assert {q.world for q in drive.queries} == {"Road11/BJ20170901A", "Road2/BJ20170901A"}
        assert [q.position_m for q in drive.queries[1:]] == [(10.0, 3645.2, 38.6), (11.0, 3645.2, 38.6)]
        assert drive.references[1].position_m == (10.8, 3645.2, 38.6)
        assert ["Record015/Camera 6: no folder of camera 5" in sentence for sentence in drive.unmatched] == [
            True,
            False,
        ]
        assert f"Record014/Camera 6/{THIRD}_Camera_6: no query in record Road11/BJ" in drive.unmatched[1]
        assert drive.notes == [OFFSET]
        one = apollo_roads_drive(root, roads=["Road2"])
        assert ([q.moment for q in one.queries], one.unmatched) == ([THIRD], [])
        assert [q.record for q in apollo_roads_drive(root / "Train/Road2").queries] == ["BJ20170901A/Record014"]

    def test_matrices_with_names_in_the_earlier_release(self, grow, write) -> None:
        """Record001/Camera 5/pose.txt, below Pose beside ColorImage; the translation is the last column."""
        for camera in ("Camera 5", "Camera 6"):
            tail = camera.replace(" ", "_")
            root = grow(f"ColorImage/Record001/{camera}/{FIRST}_{tail}.jpg")
            write(f"Pose/Record001/{camera}/pose.txt", f"1 0 0 7.5 0 1 0 -8 0 0 1 9 0 0 0 1 {FIRST}_{tail}.jpg\n")
        drive = apollo_roads_drive(root)
        assert (drive.queries[0].record, drive.queries[0].position_m) == ("Record001", (7.5, -8.0, 9.0))

    def test_mistakes_are_one_sentence(self, grow, write) -> None:
        root = self.road(grow, write, "Road11", "Camera 5", "Camera 6")
        with pytest.raises(
            UserError, match=r"data\.roads names Road12, which .*Train does not hold; .* Road11, or null"
        ):
            apollo_roads_drive(root, roads=["Road11", "Road12"])
        with pytest.raises(UserError, match=r"data\.roads names no road"):
            apollo_roads_drive(root, roads=[])
        with pytest.raises(UserError, match=r"no folder of camera 5 or 6 below .*Test: ApolloScape's roads are"):
            apollo_roads_drive(root, part="Test")
