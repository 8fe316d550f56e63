"""ApolloScape's larger self-localisation roads: {Train,Test}/RoadNN/image/{record time}/RecordNNN/"Camera 5"."""

from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from diffnav.data.driving.apollo import CameraFolders, Place, apollo_drive, both_cameras
from diffnav.data.driving.driving_set import DrivingSet
from diffnav.data.driving.poses import apollo_positions
from diffnav.errors import UserError

# Folder of pictures -> folder of poses, in this release and an earlier one.
_POSES = {"image": "pose", "ColorImage": "Pose"}
TREE = (
    'ApolloScape\'s roads are Train/RoadNN/image/{record time}/RecordNNN/"Camera 5" and "Camera 6" (or Camera_5), with '
    "poses below pose in place of image; give the folder that holds Train and Test, or one road, as data.root"
)
OFFSET = "positions of different recording times carry an offset: distances are taken within one recording time alone"


def apollo_roads_drive(
    root: str | Path,
    part: str = "Train",
    roads: Sequence[str] | None = None,
    query_camera: int = 5,
    reference_camera: int = 6,
    tolerance_s: float | None = None,
) -> DrivingSet:
    """The pairs of all records of some roads; a record is RoadNN/{record time}/RecordNNN.

    Args:
        root: the folder that holds `part`, or what is in it.
        part: Train, or Test, which has no poses. roads: names such as Road11; None takes all.
        tolerance_s: seconds that partners may differ by; None pairs equal {date}_{time}.
    Raises: UserError, describing the expected folders, if a road or camera is missing, or nothing pairs.
    """
    # Absolute, for its name may become a record's.
    root = Path(root).expanduser().absolute()
    base = root / part if (root / part).is_dir() else root
    cameras = both_cameras(base, query_camera, reference_camera, TREE)
    if roads is not None:
        cameras = _of_roads(cameras, roads, base)

    def place(parent: str, folder: Path) -> Place:
        steps = PurePosixPath(parent).parts
        names = [base.name, *(step for step in steps if step not in _POSES)]
        # The first is no part of the names, unless nothing else tells whose drive it is.
        record, world = "/".join(names[1:]) or names[0], "/".join(names[1:-1]) or names[0]
        poses = base.joinpath(*(_POSES.get(step, step) for step in steps))
        file = next((one for one in _pose_files(poses, folder.name) if one.is_file()), None)
        return Place(record, world, apollo_positions(file) if file else {})

    drive = apollo_drive("apollo_roads", base, cameras, place, tolerance_s=tolerance_s)
    drive.notes.append(OFFSET)
    return drive


def _of_roads(cameras: CameraFolders, roads: Sequence[str], base: Path) -> CameraFolders:
    """The folders of these roads. Raises: UserError for a road that has none."""
    there = {_road(parent) for parent in cameras.queries}
    missing = [road for road in roads if road not in there]
    if missing or not roads:
        wrong = f"{', '.join(missing)}, which {base} does not hold" if missing else "no road"
        raise UserError(f"data.roads names {wrong}; there are {', '.join(sorted(there))}, or null for all")

    def chosen(folders: dict[str, Path]) -> dict[str, Path]:
        return {parent: folder for parent, folder in folders.items() if _road(parent) in roads}

    alone = {parent: sentence for parent, sentence in cameras.alone.items() if _road(parent) in roads}
    return CameraFolders(chosen(cameras.queries), chosen(cameras.references), alone)


def _road(parent: str) -> str:
    return parent.split("/")[0]


def _pose_files(folder: Path, camera: str) -> list[Path]:
    """Where a record's folder of poses may keep one camera's: with or without a folder, a blank or an underscore."""
    names = dict.fromkeys((camera, camera.replace(" ", "_"), camera.replace("_", " ")))
    return [file for name in names for file in (folder / name / "pose.txt", folder / f"{name}.txt")]
