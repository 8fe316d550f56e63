"""ApolloScape's stereo set: camera_5 beside camera_6, pictures named by their time, no positions."""

from pathlib import Path

from diffnav.data.driving.apollo import Place, apollo_drive, both_cameras
from diffnav.data.driving.driving_set import DrivingSet

TREE = (
    "ApolloScape stereo is folders camera_5 and camera_6 of pictures {date}_{time}_Camera_5.jpg, perhaps in parts; "
    "give the folder that holds them as data.root"
)


def apollo_stereo_drive(
    root: str | Path,
    query_camera: int = 5,
    reference_camera: int = 6,
    tolerance_s: float | None = None,
    consecutive: bool = False,
) -> DrivingSet:
    """The pairs of camera_5 and camera_6 in every part below `root`, a record each.

    Args:
        tolerance_s: seconds that partners may differ by; None pairs equal {date}_{time}.
        consecutive: whether neighbours in time follow each other in a drive; the published parts are thinned.
    Raises: UserError, describing the expected folders, if a camera is missing or nothing pairs.
    """
    # Absolute, for its name may become a record's.
    root = Path(root).expanduser().absolute()
    cameras = both_cameras(root, query_camera, reference_camera, TREE)

    def place(part: str, _: Path) -> Place:
        record = root.name if part == "." else part
        return Place(record, record, {})

    return apollo_drive("apollo_stereo", root, cameras, place, consecutive=consecutive, tolerance_s=tolerance_s)
