"""The timing of the driving experiment as rows and as a Markdown page."""

from collections.abc import Mapping
from typing import Any

from diffnav.evaluation.cells import protocol_section
from diffnav.evaluation.driving.speed import Speed
from diffnav.evaluation.tables import markdown_table

_NOTES = """`busy`: seconds of all processes together; `wall`: until it was done. `naive`: both pictures of every pair
are read and searched for features anew; `pair by pair`: features once, each pair by OpenCV; both timed on a subset,
multiplied up to all pairs and divided among the processes."""


def speed_rows(speed: Speed, workers: int) -> list[dict[str, Any]]:
    """One plain row per stage, then per way of matching all pairs: minutes, measured or multiplied up."""
    references, queries = speed.stages[0].wall_s or 0.0, speed.stages[1].wall_s or 0.0
    short = next(stage.wall_s for stage in speed.stages if "shortlist" in stage.name) or 0.0
    ways = {
        "all pairs": (references + queries, True),
        "shortlist": (references + short, True),
        "pair by pair": (references + queries + _more(speed, workers), False),
        "naive": (speed.naive_s * speed.pairs / workers, False),
    }
    return [{"way": way, "minutes": seconds / 60, "measured": measured} for way, (seconds, measured) in ways.items()]


def speed_page(speed: Speed, rows: list[dict[str, Any]], protocol: Mapping[str, Any]) -> str:
    """The whole page."""
    stages = [
        {
            "stage": stage.name,
            "n": f"{stage.count} x {stage.unit}",
            "busy, s": "-" if stage.busy_s is None else f"{stage.busy_s:.0f}",
            "wall, s": "-" if stage.wall_s is None else f"{stage.wall_s:.0f}",
            "ms each": f"{1000 * ((stage.busy_s if stage.wall_s is None else stage.wall_s) or 0) / stage.count:.2f}",
        }
        for stage in speed.stages
    ]
    ways = [
        {"way": row["way"], "minutes": f"{row['minutes']:.1f}", "": "" if row["measured"] else "multiplied up"}
        for row in rows
    ]
    same = "the same" if speed.identical else "NOT the same"
    facts = (
        f"One pair: {1000 * speed.naive_s:.0f} ms naive, {1000 * speed.pair_by_pair_s:.2f} ms pair by pair. The "
        f"{speed.subset} pairs of the subset have {same} matches in all three ways. All processes together held "
        f"{speed.peak_gb:.2f} GB at most. Accuracy {speed.accuracy:.4f} among all, {speed.shortlist_accuracy:.4f} by "
        "shortlist."
    )
    parts = ["# Driving at full size", markdown_table(list(ways[0]), ways), facts, "## Stages"]
    parts += [markdown_table(list(stages[0]), stages), _NOTES, protocol_section(protocol)]
    return "\n\n".join(parts) + "\n"


def _more(speed: Speed, workers: int) -> float:
    """Seconds by which matching pair by pair takes longer than all at once."""
    match = next(stage for stage in speed.stages if stage.name == "of these: match")
    return (speed.pair_by_pair_s * speed.pairs - (match.busy_s or 0.0)) / workers
