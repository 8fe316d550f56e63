"""Where cameras were: the position files of the public driving sets. Metres, in each file's own frame."""

import re
from bisect import bisect_left
from pathlib import Path

from diffnav.data.driving.driving_set import Position
from diffnav.errors import UserError

# Beyond this a car has moved too far, and turned too much, for a straight line between two known positions.
LONGEST_GAP_S = 2.0


def apollo_positions(file: Path) -> dict[str, Position]:
    """Picture's name without ending -> position, of an ApolloScape pose file in either of its two forms.

    Lines are "name roll,pitch,yaw,x,y,z" or a 4 x 4 matrix, camera to world, as 16 numbers row by row, and the name.
    Raises: UserError, naming the line, if one is neither.
    """
    found = {}
    for number, line in _lines(file):
        words = line.split()
        if len(words) >= 17:
            name, values, places = " ".join(words[16:]), words[:16], (3, 7, 11)
        else:
            name, values, places = " ".join(words[:-1]), words[-1].split(","), (3, 4, 5)
        if not name or len(values) not in (6, 16):
            raise UserError(
                f"{file} line {number}: neither 'name roll,pitch,yaw,x,y,z' nor 16 numbers and a name; replace the file"
            )
        numbers = _numbers(file, number, values)
        found[Path(name).stem] = (numbers[places[0]], numbers[places[1]], numbers[places[2]])
    return found


def kitti_positions(file: Path) -> list[Position]:
    """Position k of frame k, of KITTI's poses: lines of a 3 x 4 matrix, first camera to world, row by row.

    Raises: UserError, naming the line, if one has not 12 numbers.
    """
    positions = []
    for number, line in _lines(file):
        values = _numbers(file, number, line.split())
        if len(values) != 12:
            raise UserError(f"{file} line {number}: a pose has 12 numbers, found {len(values)}; replace the file")
        positions.append((values[3], values[7], values[11]))
    return positions


def kitti_times(file: Path) -> list[float]:
    """Seconds of frame k, of KITTI's times.txt: a number a line. Raises: UserError, naming the line."""
    return [_numbers(file, number, [line])[0] for number, line in _lines(file)]


def four_seasons_times(file: Path) -> dict[str, float]:
    """Frame -> seconds since 1970, of 4Seasons' times.txt: frame, time in seconds, exposure.

    A line may hold the frame alone, which is its time in nanoseconds. Raises: UserError, naming the line.
    """
    times = {}
    for number, line in _lines(file):
        words = _words(line)
        values = _numbers(file, number, words[:2])
        times[words[0]] = values[1] if len(values) > 1 else values[0] * 1e-9
    return times


def four_seasons_track(file: Path) -> list[tuple[float, Position]]:
    """(seconds, position) sorted by time, of 4Seasons' GNSSPoses.txt or result.txt, told apart by their first column.

    GNSSPoses: nanoseconds, x, y, z, quaternion, scale, ...: key frames, and the position is scale times x, y, z.
    result: seconds, x, y, z, quaternion: all frames, of odometry alone, which drifts.
    Raises: UserError, naming the line, if one has fewer than 8 numbers.
    """
    track = []
    for number, line in _lines(file):
        words = _words(line)
        values = _numbers(file, number, words)
        if len(values) < 8:
            raise UserError(
                f"{file} line {number}: a pose has 8 numbers or more, found {len(values)}; replace the file"
            )
        scale = values[8] if len(values) > 8 else 1.0
        time_s = values[0] * 1e-9 if words[0].isdecimal() else values[0]
        track.append((time_s, (scale * values[1], scale * values[2], scale * values[3])))
    return sorted(track)


def position_at(track: list[tuple[float, Position]], time_s: float) -> Position | None:
    """The position at a time, on the straight line between its two neighbours in a sorted track; None outside of it.

    None also where the neighbours are more than LONGEST_GAP_S apart.
    """
    # Times in names and in files may differ by a rounding.
    first = bisect_left(track, time_s - 1e-5, key=lambda entry: entry[0])
    if first < len(track) and abs(track[first][0] - time_s) <= 1e-5:
        return track[first][1]
    if first in (0, len(track)) or track[first][0] - track[first - 1][0] > LONGEST_GAP_S:
        return None
    (before_s, before), (after_s, after) = track[first - 1 : first + 1]
    share = (time_s - before_s) / (after_s - before_s)
    x, y, z = (a + share * (b - a) for a, b in zip(before, after, strict=True))
    return x, y, z


def _lines(file: Path) -> list[tuple[int, str]]:
    """(number from 1, line) of a text file without blank lines and comments."""
    try:
        lines = file.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not a text file"
        raise UserError(f"{file}: cannot be read ({reason}); replace the file") from None
    return [(k, line) for k, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")]


def _words(line: str) -> list[str]:
    return re.split(r"[,\s]+", line.strip().rstrip(","))


def _numbers(file: Path, number: int, words: list[str]) -> list[float]:
    try:
        return [float(word) for word in words]
    except ValueError:
        raise UserError(f"{file} line {number}: not numbers ({' '.join(words)[:60]}); replace the file") from None
