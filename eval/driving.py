"""python -m eval.driving: Table 3 of the paper, which reference each dark street picture is the partner of."""

import sys
from pathlib import Path
from typing import Any

from omegaconf import DictConfig

from conf.command import command, pick_device, whole_number
from diffnav.evaluation.driving.drive_test import DriveTest
from diffnav.evaluation.driving.figure_11 import write_figure_11
from diffnav.evaluation.driving.measure import known_records, measure_drive, require_one
from diffnav.evaluation.driving.page import driving_page, driving_table, failure_sentences
from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.driving.rows import driving_rows
from diffnav.evaluation.driving.similarity_picture import write_similarity_picture
from diffnav.evaluation.driving.tables import query_lines
from diffnav.evaluation.tables import write_csv, write_json, write_text
from diffnav.evaluation.workers import one_thread
from eval.contest_session import worker_count
from eval.driving_session import driving_protocol, make_drive, make_shard, make_test, open_log, remarks
from eval.session import make_methods


@command("driving")
def main(cfg: DictConfig) -> None:
    device, out = pick_device(cfg.device), Path(str(cfg.out)).expanduser()
    whole_number("figures", cfg.figures, 0)
    shard, workers = make_shard(cfg), worker_count(cfg, device)
    methods, drive = make_methods(cfg, device), make_drive(cfg)
    log = open_log(out, shard)

    with one_thread():
        test = make_test(cfg, drive, methods, workers)
        for sentence in [*test.drive.unmatched, *remarks(test.drive, list(test.references))]:
            print(f"note: {sentence}", file=sys.stderr)
        for record, count in test.drive.counts.items():
            print(f"{record}: {count} pairs")
        made = measure_drive(test, log, shard, workers, progress=True)
        # Read again: shards that run at the same time have gone on meanwhile.
        records, missing = known_records(test, open_log(out, shard))
        if missing:
            print(f"{log.path}: {made} answers; the other shards have {missing} left, the last one writes the tables")
            return
        require_one(records)
        rows = write_results(cfg, out, test, records, driving_protocol(cfg, device, test, workers))
    for failure in failure_sentences(rows):
        print(f"failed: {failure}", file=sys.stderr)
    print(driving_table(rows))
    print(f"{out}: {len(records)} answers, {len(records) - made} of them from before")


def write_results(
    cfg: DictConfig, out: Path, test: DriveTest, records: list[DrivingRecord], protocol: dict[str, Any]
) -> list[dict[str, Any]]:
    """Write tables and pictures into `out`; the rows."""
    rows = driving_rows(records, test.drive, cfg.seed)
    write_csv(out / "per_query.csv", query_lines(records, test.drive))
    write_json(out / "driving.json", {"rows": rows, "protocol": protocol})
    write_text(out / "driving.md", driving_page(rows, records, test.drive, protocol))
    if cfg.figures:
        write_figure_11(out / "figure_11.jpg", records, test, cfg.figures)
        write_similarity_picture(out / "similarity.png", records)
    return rows


if __name__ == "__main__":
    main()
