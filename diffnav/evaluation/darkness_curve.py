"""The darkness curve: correct matches against one kind of darkness at a time, for every method and matcher."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from diffnav.darkness import DarknessModel
from diffnav.data.match_pairs.match_pair import MatchPairs
from diffnav.errors import UserError
from diffnav.evaluation.aggregate import Row, mean_with_interval
from diffnav.evaluation.contest import Contest
from diffnav.evaluation.match_records import MatchRecord
from diffnav.evaluation.matching import MatchMeasurement, measure_matches
from diffnav.evaluation.records import RecordLog

SCORES = ("correct", "mp", "precision")


@dataclass(frozen=True)
class Condition:
    """One point of the curves. axis: gamma, noise or blur_px; level: on it; darkness: the same for every photo."""

    axis: str
    level: float
    darkness: DarknessModel


def curve_conditions(
    gamma: Sequence[float],
    noise: Sequence[float],
    blur_px: Sequence[float],
    base_gamma: float = 4.0,
    read_share: float = 0.4,
    quality: int = 95,
) -> list[Condition]:
    """The points of three curves: gamma alone; noise, and motion blur, each at gamma `base_gamma`.

    Args:
        gamma, noise, blur_px: the levels of each axis, rising. noise: standard deviation of the shot noise at full
            intensity, that of the read noise is `read_share` of it, both on [0, 1]. blur_px: length, 1 for none.
        quality: of the JPEG.
    Raises: UserError if an axis does not rise, or a level is out of range.
    """

    def fixed(gamma: float, noise: float = 0.0, blur_px: float = 1.0) -> DarknessModel:
        read = read_share * noise
        return DarknessModel((gamma, gamma), (quality, quality), (noise, noise), (read, read), (blur_px, blur_px))

    axes = {
        "gamma": [Condition("gamma", level, fixed(level)) for level in gamma],
        "noise": [Condition("noise", level, fixed(base_gamma, noise=level)) for level in noise],
        "blur_px": [Condition("blur_px", level, fixed(base_gamma, blur_px=level)) for level in blur_px],
    }
    for axis, conditions in axes.items():
        levels = [condition.level for condition in conditions]
        if levels != sorted(set(levels)):
            raise UserError(f"curve.{axis} must be levels that rise, got {levels}")
    return [condition for conditions in axes.values() for condition in conditions]


def measure_curve(
    conditions: Sequence[Condition],
    make_pairs: Callable[[DarknessModel], MatchPairs],
    contest: Contest,
    log: RecordLog[MatchRecord],
    workers: int = 1,
    progress: bool = False,
) -> MatchMeasurement:
    """Everything measured, `records` being of each condition; equal darkness on two axes is measured once.

    make_pairs: the queries and references under one darkness.
    """
    sources = {condition.darkness: make_pairs(condition.darkness) for condition in conditions}
    places = [(darkness, photo) for darkness, pairs in sources.items() for photo in pairs.photos]
    jobs = [(sources[darkness], photo) for darkness, photo in places]
    measured = measure_matches(jobs, contest, log, workers, progress)
    found: dict[DarknessModel, list[MatchRecord]] = {darkness: [] for darkness in sources}
    for (darkness, _), records in zip(places, measured.records, strict=True):
        found[darkness] += records
    problems = list(dict.fromkeys(measured.problems))
    return replace(measured, records=[found[condition.darkness] for condition in conditions], problems=problems)


def curve_rows(conditions: Sequence[Condition], records: Sequence[Sequence[MatchRecord]], seed: int = 0) -> list[Row]:
    """One plain row per axis, level, method and matcher: means over n pairs, with 95 % bootstrap intervals."""
    rows = []
    for condition, measured in zip(conditions, records, strict=True):
        groups: dict[tuple[str, str], list[MatchRecord]] = {}
        for record in measured:
            groups.setdefault((record.method, record.matcher), []).append(record)
        for (method, matcher), own in groups.items():
            row: Row = {"axis": condition.axis, "level": condition.level, "method": method, "matcher": matcher}
            for score in SCORES:
                row |= mean_with_interval(score, [getattr(r, score) for r in own], seed)
            rows.append({**row, "n": len(own)})
    return rows


def flat_row(row: Row) -> Row:
    """A row for a CSV file: intervals as two columns each, NAME_low and NAME_high."""
    flat: Row = {}
    for name, value in row.items():
        if isinstance(value, list):
            flat |= dict(zip((name.replace("_ci", "_low"), name.replace("_ci", "_high")), value, strict=True))
        else:
            flat[name] = value
    return flat


def breakdown_level(levels: Sequence[float], values: Sequence[float]) -> float | None:
    """The level above which a curve stays below half of its maximum, on straight lines between its points.

    None if it ends at half of it or above.
    """
    bound = max(values) / 2
    last = max(index for index, value in enumerate(values) if value >= bound)
    if last == len(values) - 1:
        return None
    share = (values[last] - bound) / (values[last] - values[last + 1])
    return levels[last] + share * (levels[last + 1] - levels[last])
