"""python -m eval.navigation: where pictures were taken, on georeferenced maps; with truth, how well that is found."""

import sys
from collections import Counter
from pathlib import Path

from omegaconf import DictConfig

from conf.command import command, pick_device, whole_number
from diffnav.errors import UserError
from diffnav.evaluation.navigation.figure_10 import write_figure_10
from diffnav.evaluation.navigation.measure import measure_navigation
from diffnav.evaluation.navigation.page import navigation_table
from diffnav.evaluation.navigation.records import NavigationRecord
from diffnav.evaluation.navigation.shown import write_exports
from diffnav.evaluation.navigation.tables import write_tables
from diffnav.evaluation.records import RecordLog
from diffnav.evaluation.workers import one_thread
from eval.contest_session import worker_count
from eval.gate_session import calibrated, calibrates_only, calibration_line, make_gate
from eval.navigation_session import make_maps, make_queries, make_trial, navigation_protocol
from eval.session import make_methods


@command("navigation")
def main(cfg: DictConfig) -> None:
    device, out = pick_device(cfg.device), Path(str(cfg.out)).expanduser()
    methods, figures = make_methods(cfg, device), whole_number("figures", cfg.figures, 0)
    if calibrates_only(cfg):
        print(calibration_line(calibrated(cfg, methods, out), out))
        return
    maps = make_maps(cfg)
    queries = make_queries(cfg, maps)
    for problem in queries.problems:
        print(f"note: {problem}", file=sys.stderr)
    trial, workers = make_trial(cfg, maps, methods, make_gate(cfg, methods, out)), worker_count(cfg, device)
    log = RecordLog(out / "records.jsonl", NavigationRecord)

    with one_thread():
        records = measure_navigation(queries.queries, trial, log, workers, progress=True)
        rows = write_tables(out, records, navigation_protocol(cfg, device, trial, queries, workers))
        write_exports(out, records, queries.queries, maps)
        write_figure_10(out / "figure_10.png", records, queries.queries, trial, figures)
    for failure, count in Counter(record.failure for record in records if record.failure).items():
        print(f"failed {count} times: {failure}", file=sys.stderr)
    print(navigation_table(rows))
    located = sum(record.is_fix for record in records)
    print(f"{out}: {len(records)} answers, {log.reused} of them from before, {located} with a place")
    if not any(record.is_usable for record in records):
        raise UserError(f"none of the {len(queries.queries)} queries could be used; {out}/per_query.csv says why")


if __name__ == "__main__":
    main()
