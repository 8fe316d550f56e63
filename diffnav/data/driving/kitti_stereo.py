"""KITTI stereo 2015: image_2 beside image_3, single scenes, no drive."""

from collections.abc import Sequence
from pathlib import Path

from diffnav.data.driving.camera_folder import pictures_in
from diffnav.data.driving.driving_set import DrivingSet, Frame
from diffnav.data.driving.kitti_folders import cameras_of
from diffnav.data.driving.pairing import pair_frames
from diffnav.errors import UserError

TREE = (
    "KITTI stereo 2015 is training/image_2 and image_3 of pictures NNNNNN_10.png (or NNNNNN.png); give the folder "
    "that holds training, or the two, as data.root"
)


def kitti_stereo_scenes(root: str | Path, part: str = "training", cameras: Sequence[str] | None = None) -> DrivingSet:
    """The pairs of single scenes, paired by name, without positions; neighbours may be of one drive, far apart.

    Args:
        root: the folder that holds `part`, or the cameras' folders themselves. part: training or testing.
        cameras: folders of queries and of references; None takes image_2 and image_3.
    Pictures NNNNNN_11 are the same scenes a tenth of a second later and are passed over.
    Raises: UserError, describing the expected folders, if one is missing or nothing pairs.
    """
    # Absolute, for its name may become a record's.
    root = Path(root).expanduser().absolute()
    base = root / part if (root / part).is_dir() else root
    if not base.is_dir():
        raise UserError(f"no folder {base}: {TREE}")
    sides, later = [], 0
    for camera in cameras_of(base, cameras, TREE):
        paths = pictures_in(base / camera)
        scenes = [path for path in paths if not path.stem.endswith("_11")]
        later += len(paths) - len(scenes)
        sides.append([_frame(base, path, camera) for path in scenes])
    notes = [f"{later} pictures NNNNNN_11, a tenth of a second later, are passed over"] if later else []
    return pair_frames("kitti_stereo", sides[0], sides[1], consecutive=False, notes=notes, rectified=True)


def _frame(base: Path, path: Path, camera: str) -> Frame:
    name = path.relative_to(base).with_suffix("").as_posix()
    return Frame(name=name, picture=path, camera=camera, record=base.name, moment=path.stem)
