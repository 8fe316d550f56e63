"""KITTI odometry: image_0 beside image_1 (grey) or image_2 beside image_3 (colour), with a pose for each frame."""

from collections.abc import Sequence
from pathlib import Path

from diffnav.data.driving.camera_folder import pictures_in
from diffnav.data.driving.driving_set import DrivingSet, Frame, Position
from diffnav.data.driving.kitti_folders import cameras_of
from diffnav.data.driving.pairing import pair_frames
from diffnav.data.driving.poses import kitti_positions, kitti_times
from diffnav.errors import UserError

TREE = (
    "KITTI odometry is sequences/NN/image_0 and image_1 (or image_2 and image_3), times.txt and poses/NN.txt; give "
    "the folder that holds sequences, or one sequence with poses.txt in it, as data.root"
)


def kitti_odometry_drive(
    root: str | Path, sequences: Sequence[str] | None = None, cameras: Sequence[str] | None = None
) -> DrivingSet:
    """The pairs of one sequence, or of several; positions are the first camera's, for both pictures of a pair.

    Args:
        sequences: names such as 00, below root/sequences; None takes all.
        cameras: folders of queries and of references; None takes image_2 and image_3 where both exist, else image_0
            and image_1.
    Raises: UserError, describing the expected folders, if one is missing, a file is damaged or nothing pairs.
    """
    # Absolute, for its name may become a record's.
    root = Path(root).expanduser().absolute()
    folders = _sequences(root, sequences)
    sides: tuple[list[Frame], list[Frame]] = [], []
    notes = []
    for folder in folders:
        poses = next((file for file in _pose_files(folder) if file.is_file()), None)
        positions = kitti_positions(poses) if poses else []
        times = kitti_times(folder / "times.txt") if (folder / "times.txt").is_file() else []
        if poses is None:
            notes.append(f"{folder.name}: no positions")
        for side, camera in zip(sides, cameras_of(folder, cameras, TREE), strict=True):
            side += [_frame(root, path, folder.name, times, positions) for path in pictures_in(folder / camera)]
    return pair_frames("kitti_odometry", *sides, consecutive=True, notes=notes, rectified=True)


def _frame(root: Path, path: Path, sequence: str, times: list[float], positions: list[Position]) -> Frame:
    # Lines of both files count frames from 0.
    number = int(path.stem) if path.stem.isdecimal() else len(times) + len(positions)
    return Frame(
        name=path.relative_to(root).with_suffix("").as_posix(),
        picture=path,
        camera=path.parent.name,
        record=sequence,
        moment=path.stem,
        time_s=times[number] if number < len(times) else None,
        position_m=positions[number] if number < len(positions) else None,
        world=sequence,
    )


def _sequences(root: Path, names: Sequence[str] | None) -> list[Path]:
    if not root.is_dir():
        raise UserError(f"no folder {root}: {TREE}")
    parent = root / "sequences"
    if not parent.is_dir():
        if names is not None:
            raise UserError(f"no folder {parent}, so data.sequences must be null: {root} is taken as one sequence")
        return [root]
    there = sorted(folder for folder in parent.iterdir() if any(folder.glob("image_?")))
    wanted = [parent / name for name in names] if names is not None else there
    missing = [folder for folder in wanted if folder not in there]
    if missing or not wanted:
        raise UserError(f"no pictures in {missing[0] if missing else parent}: {TREE}")
    return wanted


def _pose_files(folder: Path) -> list[Path]:
    return [folder / "poses.txt", folder.parent.parent / "poses" / f"{folder.name}.txt"]
