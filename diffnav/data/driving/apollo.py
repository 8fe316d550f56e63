"""What ApolloScape's data sets share: folders of cameras, and pictures named {date}_{time}_{camera}.jpg."""

import os
import re
from collections.abc import Callable, Iterable, Mapping
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from diffnav.data.driving.camera_folder import pictures_in
from diffnav.data.driving.driving_set import DrivingSet, Frame, Position
from diffnav.data.driving.pairing import pair_frames
from diffnav.errors import UserError

# yymmdd_hhmmssfff
_STAMP = re.compile(r"\d{6}_\d{9}")


class CameraFolders(NamedTuple):
    """The folders of two cameras: path of their parent below a root -> folder, for the parents that hold both.

    alone: parent -> a sentence, for those that hold one of the cameras.
    """

    queries: dict[str, Path]
    references: dict[str, Path]
    alone: dict[str, str]


class Place(NamedTuple):
    """What the layout tells of one camera's folder: its record, and positions by picture's name without ending."""

    record: str
    world: str
    positions: Mapping[str, Position]


def both_cameras(root: Path, query_camera: int, reference_camera: int, tree: str) -> CameraFolders:
    """The folders of two cameras anywhere below `root`, named Camera_5, camera_5 or "Camera 5".

    tree: the expected folders, a sentence for the errors. Raises: UserError if nothing holds both.
    """
    if not root.is_dir():
        raise UserError(f"no folder {root}: {tree}")
    if query_camera == reference_camera:
        raise UserError(f"data.query_camera and data.reference_camera are both {query_camera}; name two cameras")
    sides = {camera: _camera_folders(root, camera) for camera in (query_camera, reference_camera)}
    ours, theirs = sides[query_camera], sides[reference_camera]
    shared = sorted(ours.keys() & theirs.keys())
    if not shared:
        missing = " or ".join(str(camera) for camera, folders in sides.items() if not folders)
        what = f"of camera {missing}" if missing else f"that holds both camera {query_camera} and {reference_camera}"
        raise UserError(f"no folder {what} below {root}: {tree}")
    alone = {
        parent: f"{folders[parent]}: no folder of camera {other} beside it; left out"
        for folders, other in ((ours, reference_camera), (theirs, query_camera))
        for parent in sorted(folders.keys() - set(shared))
    }
    return CameraFolders({p: ours[p] for p in shared}, {p: theirs[p] for p in shared}, alone)


def apollo_drive(
    name: str,
    root: Path,
    cameras: CameraFolders,
    place: Callable[[str, Path], Place],
    pictures: Callable[[Path], Iterable[Path]] | None = None,
    consecutive: bool = True,
    tolerance_s: float | None = None,
) -> DrivingSet:
    """The pairs of two cameras' folders, by {date}_{time} or the nearest time; names of frames are paths below root.

    Args:
        place: (parent's path below the root, camera's folder) -> `Place`. pictures: the pictures of a camera's
            folder that count; None for all. consecutive, tolerance_s: see `pair_frames`.
    Raises: UserError if nothing pairs.
    """
    unmatched = list(cameras.alone.values())
    sides: list[list[Frame]] = []
    for folders in (cameras.queries, cameras.references):
        sides.append([])
        for parent, folder in folders.items():
            where = place(parent, folder)
            for path in pictures(folder) if pictures else pictures_in(folder):
                frame = _frame(root, path, where)
                if frame is None:
                    unmatched.append(f"{path}: its name is not {{date}}_{{time}}_{{camera}}; left out")
                else:
                    sides[-1].append(frame)
    return pair_frames(name, sides[0], sides[1], consecutive, tolerance_s, unmatched)


def apollo_time_s(moment: str) -> float | None:
    """Seconds since 1970 of yymmdd_hhmmssfff; None where the digits are no date and time."""
    if not _STAMP.fullmatch(moment):
        return None
    try:
        second = datetime.strptime(f"{moment[:-3]}+0000", "%y%m%d_%H%M%S%z")
    except ValueError:
        return None
    return second.timestamp() + int(moment[-3:]) / 1000


def _frame(root: Path, path: Path, place: Place) -> Frame | None:
    parts = path.stem.split("_")
    if len(parts) < 3 or not all(part.isdecimal() for part in parts[:2]):
        return None
    moment = "_".join(parts[:2])
    return Frame(
        name=path.relative_to(root).with_suffix("").as_posix(),
        picture=path,
        camera=path.parent.name,
        record=place.record,
        moment=moment,
        time_s=apollo_time_s(moment),
        position_m=place.positions.get(path.stem),
        world=place.world,
    )


def _camera_folders(root: Path, camera: int) -> dict[str, Path]:
    named = re.compile(rf"camera[ _]?{camera}", re.IGNORECASE)
    found: dict[str, Path] = {}
    for parent, folders, _ in os.walk(root, followlinks=True):
        cameras = sorted(folder for folder in folders if folder.lower().startswith("camera"))
        ours = [folder for folder in cameras if named.fullmatch(folder)]
        if len(ours) > 1:
            raise UserError(f"{parent} holds camera {camera} twice ({', '.join(ours)}); keep one of the folders")
        if ours:
            found[Path(parent).relative_to(root).as_posix()] = Path(parent) / ours[0]
        # Folders of pictures are long, and nothing lies below them.
        folders[:] = sorted(folder for folder in folders if folder not in cameras and not folder.startswith("."))
    return found
