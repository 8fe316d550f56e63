"""The matching experiment (Table 2): a record for every method's picture of every pair and every matcher."""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace

from tqdm import tqdm

from diffnav.evaluation.contest import Contest, Job
from diffnav.evaluation.match_records import MatchRecord
from diffnav.evaluation.records import RecordLog
from diffnav.evaluation.usable import refuse_none
from diffnav.evaluation.workers import spread


@dataclass
class MatchMeasurement:
    """What was measured. records: of each job, method by method and matcher by matcher; none for an unusable photo.

    problems: one sentence per photo that could not be used. left_out: one per method that could run on none.
    """

    records: list[list[MatchRecord]]
    problems: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)

    @property
    def flat(self) -> list[MatchRecord]:
        """The records of all jobs."""
        return [record for own in self.records for record in own]


def measure_matches(
    jobs: Sequence[Job], contest: Contest, log: RecordLog[MatchRecord], workers: int = 1, progress: bool = False
) -> MatchMeasurement:
    """Everything that the contest finds out about the jobs; what `log` already holds is not computed again.

    Every record is on disk as soon as its photo's methods come to it, so a stopped run goes on where it stood.

    Raises: UserError if no photo can be used.
    """
    contest = replace(contest, known=log.keys)
    # Here, so that the workers need not: each reads weights and source files.
    _ = contest.fingerprint, [m.fingerprint for m in contest.methods], [m.fingerprint for m in contest.matchers]
    names = [(method.name, named.name) for method in contest.methods for named in contest.matchers]
    found: list[dict[tuple[str, str], MatchRecord]] = [{} for _ in jobs]
    problems: dict[int, str] = {}
    with (
        tqdm(total=len(jobs) * len(names), desc="matching", unit="match", disable=not progress) as bar,
        closing(spread(contest, jobs, workers)) as outcomes,
    ):
        for index, outcome in outcomes:
            if outcome.problem is not None:
                problems[index] = outcome.problem
            record = outcome.record
            if record is not None:
                log.add(record)
            elif outcome.key:
                record = log.find(outcome.key)
            if record is not None:
                photo = jobs[index][1]
                # The same pixels and weights may go by another name today.
                label = (outcome.method, outcome.matcher)
                found[index][label] = replace(
                    record, method=label[0], matcher=label[1], name=photo.name, site=photo.site
                )
            bar.update(outcome.cells)
    if not any(found):
        refuse_none(len(jobs), [problems[index] for index in sorted(problems)])
    records = [[own[label] for label in names if label in own] for own in found]
    ran = {record.method for own in records for record in own}
    left_out = [
        f"{method.name}: it needs to know how a picture was darkened, which nobody does of real darkness"
        for method in contest.methods
        if method.name not in ran
    ]
    return MatchMeasurement(records, [problems[index] for index in sorted(problems)], left_out)
