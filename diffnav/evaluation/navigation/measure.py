"""The navigation experiment: a record for every answer to every query, kept as it comes."""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace

from tqdm import tqdm

from diffnav.data.queries.query import Query
from diffnav.evaluation.navigation.records import NavigationRecord
from diffnav.evaluation.navigation.trial import Trial
from diffnav.evaluation.records import RecordLog
from diffnav.evaluation.workers import spread
from diffnav.navigation.flight import flights_of


def measure_navigation(
    queries: Sequence[Query],
    trial: Trial,
    log: RecordLog[NavigationRecord],
    workers: int = 1,
    progress: bool = False,
) -> list[NavigationRecord]:
    """The answers to all queries, query by query; those that `log` holds are not asked again.

    Every record is on disk as soon as it is made, so a stopped run goes on where it stood.
    Raises: UserError if features of a map cannot be found or kept; ImageError for an unreadable map.
    """
    # Here, once: the workers then find them on disk.
    for searcher in trial.searchers:
        searcher.prepare(trial.maps, trial.features, progress)
    trial = replace(trial, known_keys=log.keys)
    flights = flights_of(queries) if trial.motion else [[query] for query in queries]
    found: list[list[NavigationRecord]] = [[] for _ in flights]
    with (
        tqdm(total=sum(map(trial.count, flights)), desc="locating", unit="answer", disable=not progress) as bar,
        closing(spread(trial, flights, workers)) as answers,
    ):
        for index, (key, record) in answers:
            if record is not None:
                log.add(record)
            else:
                record = log.find(key)
            if record is not None:
                found[index].append(record)
            bar.update()
    return [record for own in found for record in own]
