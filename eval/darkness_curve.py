"""python -m eval.darkness_curve: correct matches against gamma, noise and motion blur; where does each break down?"""

import sys
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import command, pick_device, plain
from diffnav.darkness import DarknessModel
from diffnav.data.match_pairs.match_pair import MatchPairs
from diffnav.data.pair_source import PairSource
from diffnav.evaluation.darkness_curve import curve_rows, flat_row, measure_curve
from diffnav.evaluation.darkness_curve_page import curve_page, write_curve_plots
from diffnav.evaluation.match_records import MatchRecord
from diffnav.evaluation.records import RecordLog
from diffnav.evaluation.tables import write_csv, write_json, write_text
from diffnav.evaluation.workers import one_thread
from eval.contest_session import contest_protocol, make_contest, worker_count
from eval.session import make_methods, make_photos, plain_list


@command("darkness_curve")
def main(cfg: DictConfig) -> None:
    device, out = pick_device(cfg.device), Path(str(cfg.out)).expanduser()
    photos, contest = make_photos(cfg), make_contest(cfg, make_methods(cfg, device))
    conditions = instantiate(cfg.curve, _convert_="all")
    size = tuple(plain_list(cfg.data.size)) or None

    def make_pairs(darkness: DarknessModel) -> MatchPairs:
        return instantiate(cfg.pairs)(PairSource(photos, darkness, cfg.seed, size))

    log, workers = RecordLog(out / "records.jsonl", MatchRecord), worker_count(cfg, device)
    with one_thread():
        measured = measure_curve(conditions, make_pairs, contest, log, workers, progress=True)
        for problem in measured.problems + measured.left_out:
            print(f"left out: {problem}", file=sys.stderr)
        for failure in sorted({f"{r.method}: {r.failure}" for r in measured.flat if r.failure}):
            print(f"failed: {failure}", file=sys.stderr)
        rows = curve_rows(conditions, measured.records, cfg.seed)
        facts = contest_protocol(cfg, device, contest, photos, workers)
        facts |= {"curve": plain(cfg.curve), "left_out": measured.problems + measured.left_out}
        write_csv(out / "darkness_curve.csv", [flat_row(row) for row in rows])
        write_json(out / "darkness_curve.json", {"rows": rows, "protocol": facts})
        write_text(out / "darkness_curve.md", curve_page(rows, facts, measured.left_out))
        plots = write_curve_plots(out, rows)
    print(f"{out}: {len(rows)} points, {log.reused} of their results from before, {len(plots)} plots")


if __name__ == "__main__":
    main()
