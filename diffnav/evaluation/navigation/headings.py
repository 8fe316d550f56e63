"""Does it matter which way the camera looked? Recall by the query's heading, every 15 degrees."""

from collections.abc import Sequence

from diffnav.evaluation.navigation.records import NavigationRecord
from diffnav.evaluation.tables import markdown_table

HEADING_M = 10
STEP_DEG = 15
# Level flight to the north is no sweep of headings: the headings must fall into so many steps.
_LEAST_STEPS = 4


def heading_recall(records: Sequence[NavigationRecord]) -> dict[int, tuple[int, int]]:
    """Heading in degrees, 0, 15, ... 345 -> (answers within 10 m, queries) of those nearest to it, with truth."""
    found: dict[int, tuple[int, int]] = {}
    for record in records:
        if record.on_map and record.has_truth and record.query_heading_deg is not None:
            heading = int((record.query_heading_deg + STEP_DEG / 2) // STEP_DEG * STEP_DEG) % 360
            right, asked = found.get(heading, (0, 0))
            hit = record.is_fix and record.error_m is not None and record.error_m <= HEADING_M
            found[heading] = (right + hit, asked + 1)
    return dict(sorted(found.items()))


def heading_table(records: Sequence[NavigationRecord]) -> str:
    """One line per heading, one column per method, matcher, mode and condition; empty where all headings are alike."""
    groups: dict[tuple[str, ...], list[NavigationRecord]] = {}
    for record in records:
        groups.setdefault((record.method, record.matcher, record.mode, record.condition), []).append(record)
    recalls = {", ".join(label): heading_recall(own) for label, own in groups.items()}
    headings = sorted({heading for recall in recalls.values() for heading in recall})
    if len(headings) < _LEAST_STEPS:
        return ""
    lines = []
    for heading in headings:
        cells = {label: recall.get(heading, (0, 0)) for label, recall in recalls.items()}
        shares = {label: f"{right / asked:.2f}" if asked else "-" for label, (right, asked) in cells.items()}
        lines.append({"heading, degrees": str(heading), "queries": str(max(n for _, n in cells.values())), **shares})
    return markdown_table(["heading, degrees", "queries", *recalls], lines)
