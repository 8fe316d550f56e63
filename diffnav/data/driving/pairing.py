"""Which pictures of two cameras belong together: by the moment in their names, or by the nearest time."""

import math
import re
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

from diffnav.data.driving.driving_set import DrivingSet, Frame
from diffnav.errors import UserError

Pair = tuple[Frame | None, Frame | None]
# Seconds since 1970 as float64 are off by up to .2 microseconds.
RESOLUTION_S = 1e-6


def pair_frames(
    name: str,
    queries: Sequence[Frame],
    references: Sequence[Frame],
    consecutive: bool,
    tolerance_s: float | None = None,
    unmatched: Sequence[str] = (),
    notes: Sequence[str] = (),
    rectified: bool = False,
) -> DrivingSet:
    """The frames of each record paired with each other, sorted by record and time; the rest is listed, never zipped.

    Args:
        name: of the set. consecutive, unmatched, notes, rectified: see `DrivingSet`; lonely frames come on top.
        tolerance_s: None pairs equal moments. A number pairs two frames that are each other's nearest in time and at
            most so many seconds apart.
    Raises: UserError if nothing pairs, a camera has one moment twice, or a time that is needed is unknown.
    """
    if tolerance_s is not None and not 0 <= tolerance_s < math.inf:
        raise UserError(f"data.tolerance_s must be 0 or more, or null to pair equal names, got {tolerance_s}")
    sides = _by_record(queries), _by_record(references)
    paired: list[tuple[Frame, Frame]] = []
    lonely = list(unmatched)
    for record in sorted(sides[0].keys() | sides[1].keys(), key=natural):
        first, second = sides[0].get(record, []), sides[1].get(record, [])
        pairs = _by_moment(first, second) if tolerance_s is None else _by_time(first, second, tolerance_s)
        for index, (query, reference) in enumerate(pairs):
            if query and reference:
                paired.append((replace(query, index=index), replace(reference, index=index)))
            else:
                alone = [frame for frame in (query, reference) if frame]
                lonely += [_sentence(frame, "reference" if frame is query else "query", tolerance_s) for frame in alone]
    if not paired:
        examples = [f"{len(side)} pictures, e.g. {side[0].name}" if side else "none" for side in (queries, references)]
        raise UserError(f"{name}: no picture has a partner (queries: {examples[0]}; references: {examples[1]})")
    ours, theirs = (list(side) for side in zip(*paired, strict=True))
    return DrivingSet(name, ours, theirs, list(range(len(ours))), consecutive, lonely, list(notes), rectified)


def natural(text: str) -> list[tuple[int, str]]:
    """A key to sort by in which 9 comes before 10, wherever in the text they stand."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", text)]


def _by_record(frames: Sequence[Frame]) -> dict[str, list[Frame]]:
    records: dict[str, list[Frame]] = defaultdict(list)
    seen: dict[tuple[str, str], Frame] = {}
    for frame in frames:
        twin = seen.setdefault((frame.record, frame.moment), frame)
        if twin is not frame:
            raise UserError(f"{twin.picture} and {frame.picture} are one camera's of one moment; keep one of them")
        records[frame.record].append(frame)
    return records


def _by_moment(queries: list[Frame], references: list[Frame]) -> list[Pair]:
    ours, theirs = ({frame.moment: frame for frame in side} for side in (queries, references))
    return [(ours.get(moment), theirs.get(moment)) for moment in sorted(ours.keys() | theirs.keys(), key=natural)]


def _by_time(queries: list[Frame], references: list[Frame], tolerance_s: float) -> list[Pair]:
    ours, theirs = (sorted(side, key=_time_s) for side in (queries, references))
    our_times, their_times = ([_time_s(frame) for frame in side] for side in (ours, theirs))
    pairs: list[Pair] = []
    taken = set()
    for k, query in enumerate(ours):
        nearest = _nearest(their_times, our_times[k])
        if (
            nearest is not None
            and _nearest(our_times, their_times[nearest]) == k
            and abs(their_times[nearest] - our_times[k]) <= tolerance_s + RESOLUTION_S
        ):
            taken.add(nearest)
            pairs.append((query, theirs[nearest]))
        else:
            pairs.append((query, None))
    pairs += [(None, reference) for k, reference in enumerate(theirs) if k not in taken]
    return sorted(pairs, key=lambda pair: min(_time_s(frame) for frame in pair if frame))


def _nearest(times: list[float], time: float) -> int | None:
    """Index of the nearest of sorted times, the earlier of two that are as near."""
    if not times:
        return None
    right = bisect_left(times, time)
    around = [k for k in (right - 1, right) if 0 <= k < len(times)]
    return min(around, key=lambda k: abs(times[k] - time))


def _time_s(frame: Frame) -> float:
    if frame.time_s is None:
        raise UserError(f"{frame.picture}: its time is unknown; set data.tolerance_s=null to pair by name alone")
    return frame.time_s


def _sentence(frame: Frame, other: str, tolerance_s: float | None) -> str:
    how = f"named {frame.moment}" if tolerance_s is None else f"within {tolerance_s:g} s"
    return f"{frame.name}: no {other} in record {frame.record} {how}; left out"
