"""4Seasons: undistorted_images/cam0 and cam1 of a stereo rig, named in nanoseconds, with two kinds of positions."""

from pathlib import Path

from diffnav.data.driving.camera_folder import pictures_in
from diffnav.data.driving.driving_set import DrivingSet, Frame, Position
from diffnav.data.driving.pairing import pair_frames
from diffnav.data.driving.poses import four_seasons_times, four_seasons_track, position_at
from diffnav.errors import UserError

# The first is measured by satellite and closed in loops, the second odometry alone.
_TRACKS = ("GNSSPoses.txt", "result.txt")
TREE = (
    "a recording of 4Seasons is undistorted_images/cam0 and cam1, times.txt and GNSSPoses.txt or result.txt; give it, "
    "or the folder that holds several, as data.root"
)


def four_seasons_drive(
    root: str | Path, query_camera: str = "cam0", reference_camera: str = "cam1", tolerance_s: float | None = None
) -> DrivingSet:
    """The pairs of one recording, or of each in a folder; positions are cam0's, for both cameras.

    Args:
        tolerance_s: seconds that partners may differ by; None pairs equal names.
    Raises: UserError, describing the expected folders, if a camera is missing, a file is damaged or nothing pairs.
    """
    # Absolute, for its name may become a record's.
    root = Path(root).expanduser().absolute()
    recordings = [root] if (root / "undistorted_images").is_dir() else sorted(root.glob("*/undistorted_images"))
    recordings = [one if one == root else one.parent for one in recordings]
    if not recordings:
        raise UserError(f"no folder {root / 'undistorted_images'}: {TREE}")
    sides: tuple[list[Frame], list[Frame]] = [], []
    notes = []
    for recording in recordings:
        times = four_seasons_times(recording / "times.txt") if (recording / "times.txt").is_file() else {}
        source = next((name for name in _TRACKS if (recording / name).is_file()), None)
        track = four_seasons_track(recording / source) if source else []
        notes.append(f"{recording.name}: positions of {source}" if source else f"{recording.name}: no positions")
        for side, camera in zip(sides, (query_camera, reference_camera), strict=True):
            side += _frames(root, recording, camera, times, track)
    return pair_frames("four_seasons", *sides, consecutive=True, tolerance_s=tolerance_s, notes=notes)


def _frames(
    root: Path, recording: Path, camera: str, times: dict[str, float], track: list[tuple[float, Position]]
) -> list[Frame]:
    folder = recording / "undistorted_images" / camera
    if not folder.is_dir():
        raise UserError(f"no folder {folder}: {TREE}")
    frames = []
    for path in pictures_in(folder):
        time_s = times.get(path.stem, int(path.stem) * 1e-9 if path.stem.isdecimal() else None)
        frames.append(
            Frame(
                name=path.relative_to(root).with_suffix("").as_posix(),
                picture=path,
                camera=camera,
                record=recording.name,
                moment=path.stem,
                time_s=time_s,
                position_m=None if time_s is None else position_at(track, time_s),
                world=recording.name,
            )
        )
    return frames
