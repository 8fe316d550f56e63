"""python -m eval.enhancement: Table 1 of the paper, its Figures 5, 6 and 9."""

import sys
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import command, pick_device, plain
from diffnav.data.pair_source import PairSource
from diffnav.evaluation.cells import failure_lines
from diffnav.evaluation.enhancement import measure
from diffnav.evaluation.enhancement_figures import choose_photos, write_figures
from diffnav.evaluation.enhancement_page import enhancement_page, scores_table
from diffnav.evaluation.predictions import PredictionCache
from diffnav.evaluation.records import ImageRecord, RecordLog
from diffnav.evaluation.rows import compare_seeds, enhancement_rows
from diffnav.evaluation.runner import Runner
from diffnav.evaluation.seeds import seed_sections
from diffnav.evaluation.tables import write_csv, write_json, write_text
from diffnav.training.allocator import keep_freed_memory
from eval.session import make_methods, make_photos, plain_list, protocol, seed_groups


@command("enhancement")
def main(cfg: DictConfig) -> None:
    device = pick_device(cfg.device)
    keep_freed_memory()
    methods, photos = make_methods(cfg, device), make_photos(cfg)
    groups = seed_groups(cfg, methods)
    shown = choose_photos(photos, cfg.figures.count, plain_list(cfg.figures.sites) or None)
    source = PairSource(photos, instantiate(cfg.darkness), cfg.seed, tuple(plain_list(cfg.data.size)) or None)
    out = Path(str(cfg.out)).expanduser()
    cache = PredictionCache(Path(str(cfg.cache)).expanduser() if cfg.cache else None)
    log = RecordLog(out / "records.jsonl", ImageRecord)
    runners = [Runner(method, cache) for method in methods]

    measured = measure(source, runners, log, progress=True)
    rows = enhancement_rows(methods, measured.records, cfg.reference, cfg.seed)
    for problem in measured.problems:
        print(f"left out: {problem}", file=sys.stderr)
    for failure in failure_lines(rows):
        print(f"failed: {failure}", file=sys.stderr)
    compared = compare_seeds(measured.records, groups, plain(cfg)["controls"] or {}, cfg.seed)
    facts = protocol(cfg, device, methods, photos)
    facts |= {"n": max(row["n"] for row in rows), "left_out": measured.problems}
    write_csv(out / "per_image.csv", [record.flat() for record in measured.records])
    write_json(out / "enhancement.json", {"rows": rows, "seeds": compared, "protocol": facts})
    write_text(out / "enhancement.md", enhancement_page(rows, facts, compared))
    figures = write_figures(out, source, runners, shown)
    print("\n\n".join([scores_table(rows), *seed_sections(compared, digits=3)]))
    print(f"{out}: {len(measured.records)} results, {log.reused} of them from before, {len(figures)} figures")


if __name__ == "__main__":
    main()
