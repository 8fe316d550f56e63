"""python -m eval.matching: Table 2 of the paper, how enhanced pictures match daylight ones, its Figure 1."""

import sys
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import command, pick_device, plain
from diffnav.data.pair_source import PairSource
from diffnav.evaluation.cells import failure_lines
from diffnav.evaluation.enhancement_figures import choose_photos
from diffnav.evaluation.match_records import MatchRecord
from diffnav.evaluation.match_rows import compare_seeds, matching_rows
from diffnav.evaluation.matching import measure_matches
from diffnav.evaluation.matching_figures import write_match_figures
from diffnav.evaluation.matching_page import correct_table, matching_page
from diffnav.evaluation.records import RecordLog
from diffnav.evaluation.runner import Runner
from diffnav.evaluation.seeds import seed_sections
from diffnav.evaluation.tables import write_csv, write_json, write_text
from diffnav.evaluation.workers import one_thread
from eval.contest_session import contest_protocol, make_contest, select, shown_methods, worker_count
from eval.session import make_methods, make_photos, plain_list, seed_groups


@command("matching")
def main(cfg: DictConfig) -> None:
    device, out = pick_device(cfg.device), Path(str(cfg.out)).expanduser()
    photos, contest = make_photos(cfg), make_contest(cfg, make_methods(cfg, device))
    groups = seed_groups(cfg, contest.methods)
    source = PairSource(photos, instantiate(cfg.darkness), cfg.seed, tuple(plain_list(cfg.data.size)) or None)
    pairs = instantiate(cfg.pairs)(source)
    shown = choose_photos(photos, len(photos), plain_list(cfg.figures.sites) or None)
    methods, matchers = (
        shown_methods(cfg, contest.methods),
        select("figures.matchers", contest.matchers, cfg.figures.matchers),
    )
    log, workers = RecordLog(out / "records.jsonl", MatchRecord), worker_count(cfg, device)

    with one_thread():
        measured = measure_matches([(pairs, photo) for photo in pairs.photos], contest, log, workers, progress=True)
        rows = matching_rows(measured.flat, plain_list(cfg.reference), cfg.seed)
        for problem in measured.problems + measured.left_out:
            print(f"left out: {problem}", file=sys.stderr)
        for failure in failure_lines(rows):
            print(f"failed: {failure}", file=sys.stderr)
        compared = compare_seeds(measured.flat, groups, plain(cfg)["controls"] or {}, cfg.seed)
        facts = contest_protocol(cfg, device, contest, pairs.photos, workers)
        facts |= {"n": max(row["n"] for row in rows), "left_out": measured.problems + measured.left_out}
        write_csv(out / "per_pair.csv", [record.flat() for record in measured.flat])
        write_json(out / "matching.json", {"rows": rows, "seeds": compared, "protocol": facts})
        write_text(out / "matching.md", matching_page(rows, facts, measured.left_out, compared))
        runners = [Runner(method, contest.cache) for method in methods]
        figures = write_match_figures(out, pairs, runners, matchers, measured.flat, shown)
    print("\n\n".join([correct_table(rows), *seed_sections(compared)]))
    print(f"{out}: {len(measured.flat)} results, {log.reused} of them from before, {len(figures)} figures")


if __name__ == "__main__":
    main()
