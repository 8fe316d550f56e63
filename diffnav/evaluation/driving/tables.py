"""Every answer of the driving experiment as a line of per_query.csv."""

from collections.abc import Sequence
from typing import Any

from diffnav.data.driving.driving_set import DrivingSet, frames_apart, metres_apart
from diffnav.evaluation.driving.records import RANKINGS, DrivingRecord


def query_lines(records: Sequence[DrivingRecord], drive: DrivingSet) -> list[dict[str, Any]]:
    """One line per record: partner, answers by either ranking, how far off they are, matches, seconds, failure."""
    return [_line(record, drive) for record in records]


def _line(record: DrivingRecord, drive: DrivingSet) -> dict[str, Any]:
    partner = drive.references[record.truth]
    line: dict[str, Any] = {
        "method": record.method,
        "matcher": record.matcher,
        "record": record.record,
        "query": record.name,
        "partner": partner.name,
        "matches_with_partner": record.counts[record.truth] if record.counts else None,
    }
    for ranking in RANKINGS:
        answer = record.answer(ranking)
        found = None if answer is None else drive.references[answer]
        line |= {
            f"answer_by_{ranking}": None if found is None else found.name,
            f"moments_off_by_{ranking}": None if found is None else frames_apart(found, partner),
            f"metres_off_by_{ranking}": None if found is None else metres_apart(found, partner),
        }
    best = record.answer("matches")
    return line | {
        "matches": 0 if best is None else record.counts[best],
        "gamma": record.gamma,
        "seconds_enhance": record.seconds_enhance,
        "seconds_features": record.seconds_features,
        "seconds_match": record.seconds_match,
        "seconds_verify": record.seconds_verify,
        "failure": record.failure,
    }
