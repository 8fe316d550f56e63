"""Any two folders of pictures of two cameras: pairs by equal names, or by the nearest of the times in the names."""

import re
from pathlib import Path

from diffnav.data.driving.driving_set import DrivingSet, Frame
from diffnav.data.driving.pairing import pair_frames
from diffnav.errors import UserError
from diffnav.images import find_images


def paired_drive(
    left: str | Path,
    right: str | Path,
    tolerance_s: float | None = None,
    time_unit_s: float = 1e-9,
    consecutive: bool = True,
    rectified: bool = False,
) -> DrivingSet:
    """Left pictures as queries, right ones as references; a record is a sub-folder that both have.

    Args:
        tolerance_s: None pairs equal names without ending. A number takes the names as times and pairs those that
            are each other's nearest and at most so many seconds apart.
        time_unit_s: seconds that a name's whole number counts, 1e-9 or 1e-6; a name with a point is in seconds.
        consecutive: whether neighbours by name follow each other in a drive.
        rectified: whether a point lies on the same row in both pictures of a pair.
    Raises: UserError if a folder is missing, empty or both are one, a name is no time, or nothing pairs.
    """
    roots = [Path(root).expanduser() for root in (left, right)]
    if roots[0].resolve() == roots[1].resolve():
        raise UserError(f"data.left and data.right are one folder, {left}; give one for each camera")
    if not time_unit_s > 0:
        raise UserError(f"data.time_unit_s must be above 0, got {time_unit_s}")
    timed = tolerance_s is not None
    sides = [
        [_frame(path, root, camera, time_unit_s if timed else None) for path in find_images(root)]
        for camera, root in zip(("left", "right"), roots, strict=True)
    ]
    return pair_frames("paired", sides[0], sides[1], consecutive, tolerance_s, rectified=rectified)


def _frame(path: Path, root: Path, camera: str, time_unit_s: float | None) -> Frame:
    parent = path.relative_to(root).parent.as_posix()
    return Frame(
        name=f"{camera}/{path.relative_to(root).with_suffix('').as_posix()}",
        picture=path,
        camera=camera,
        record="drive" if parent == "." else parent,
        moment=path.stem,
        time_s=None if time_unit_s is None else _time_s(path, time_unit_s),
    )


def _time_s(path: Path, time_unit_s: float) -> float:
    if not re.fullmatch(r"\d+(\.\d+)?", path.stem):
        raise UserError(f"{path}: its name is no time, which data.tolerance_s needs; set it to null to pair by name")
    return float(path.stem) * (1.0 if "." in path.stem else time_unit_s)
