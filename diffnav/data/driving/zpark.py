"""ApolloScape's self-localisation sample "zpark", whose training list holds the paper's 1121 pairs."""

from collections import defaultdict
from pathlib import Path

from diffnav.data.driving.apollo import Place, apollo_drive, both_cameras
from diffnav.data.driving.driving_set import DrivingSet
from diffnav.data.driving.poses import apollo_positions
from diffnav.errors import UserError

PAPER_PAIRS = 1121
# The sample's names, and those of its research release.
_IMAGES, _POSES, _LISTS = ("image", "images"), ("pose", "camera_pose"), ("trainval_split", "split")
TREE = (
    "zpark is image/RecordNNN/Camera_1 and Camera_2, pose/RecordNNN/Camera_1.txt and trainval_split/train.txt "
    "(or images, camera_pose, split); give their parent as data.root"
)


def zpark_drive(
    root: str | Path,
    part: str | None = "train",
    query_camera: int = 1,
    reference_camera: int = 2,
    tolerance_s: float | None = None,
) -> DrivingSet:
    """The pairs of the sample's training list, paired by {date}_{time}; positions are those of one map.

    Args:
        root: the folder that holds image, pose and trainval_split.
        part: the list of trainval_split to take, train or val; None takes every picture.
        tolerance_s: seconds that partners may differ by; None pairs equal {date}_{time}, the paper's 1121.
    Raises: UserError, describing the expected folders, if a folder or list is missing, a list names a picture that
        does not exist, or nothing pairs.
    """
    root = Path(root).expanduser()
    images, poses = _first(root, _IMAGES), _first(root, _POSES)
    cameras = both_cameras(images, query_camera, reference_camera, TREE)
    listed = None if part is None else _listed(_first(root, _LISTS) / f"{part}.txt", images)

    def place(record: str, folder: Path) -> Place:
        file = poses / record / f"{folder.name}.txt"
        return Place(record, "zpark", apollo_positions(file) if file.is_file() else {})

    pictures = None if listed is None else listed.__getitem__
    drive = apollo_drive("zpark", images, cameras, place, pictures, tolerance_s=tolerance_s)
    if part == "train" and len(drive) != PAPER_PAIRS:
        drive.notes.append(f"{len(drive)} pairs, where the paper has {PAPER_PAIRS}: the numbers do not compare")
    return drive


def _first(root: Path, names: tuple[str, ...]) -> Path:
    """The first of these folders that exists, else the first of them."""
    return next((root / name for name in names if (root / name).is_dir()), root / names[0])


def _listed(file: Path, images: Path) -> dict[Path, list[Path]]:
    """Camera's folder -> the pictures that a list of RecordNNN/Camera_K/name, with or without .jpg, names in it."""
    if not file.is_file():
        raise UserError(f"no list {file}: {TREE}, or set data.part=null to take every picture")
    lines = [line.strip() for line in file.read_text().splitlines()]
    named = [images / (line if line.lower().endswith(".jpg") else f"{line}.jpg") for line in lines if line]
    missing = [path for path in named if not path.is_file()]
    if missing:
        raise UserError(
            f"{file} names pictures that do not exist, {len(missing)} of {len(named)}, e.g. {missing[0]}; unpack the "
            "whole sample, or set data.part=null to take what there is"
        )
    pictures: dict[Path, list[Path]] = defaultdict(list)
    for path in dict.fromkeys(named):
        pictures[path.parent].append(path)
    return pictures
