"""python -m eval.driving_speed: how long Table 3 takes at full size, and what features found once and products buy."""

from dataclasses import asdict
from pathlib import Path

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import command, picture_size, plain, whole_number
from diffnav.data.pair_source import PairSource
from diffnav.errors import UserError
from diffnav.evaluation.driving.drive_test import DriveTest
from diffnav.evaluation.driving.references import ReferenceReader
from diffnav.evaluation.driving.speed import ENLARGED, measure_speed, street_folder
from diffnav.evaluation.driving.speed_page import speed_page, speed_rows
from diffnav.evaluation.predictions import PredictionCache
from diffnav.evaluation.provenance import git_commit, processor_name, versions
from diffnav.evaluation.tables import write_json, write_text
from diffnav.matching.verification import verify
from eval.contest_session import make_matchers, worker_count
from eval.session import configured_method


@command("driving_speed")
def main(cfg: DictConfig) -> None:
    out, cpu = Path(str(cfg.out)).expanduser(), torch.device("cpu")
    workers, matchers = worker_count(cfg, cpu), make_matchers(cfg.matchers)
    size = picture_size("size", cfg.size)
    if len(matchers) != 1 or size is None:
        raise UserError("matchers must name one, and size be [height, width]")
    count = whole_number("count", cfg.count, 2)
    pictures = Path(str(cfg.pictures)).expanduser() / f"{size[1]}x{size[0]}_{cfg.seed}"
    drive = street_folder(pictures, count, size, cfg.seed, workers)
    pairs = PairSource([], instantiate(cfg.darkness), cfg.seed)
    test = DriveTest(
        drive=drive, references=[], pairs=pairs, darkness=plain(cfg)["darkness"],
        methods=[configured_method("input", cpu)], matchers=matchers, cache=PredictionCache(None), verify=verify,
        verification={}, verified=0,
    )  # fmt: skip
    reader = ReferenceReader(matchers, None, None)
    naive, shortlist = whole_number("naive", cfg.naive, 1), whole_number("shortlist", cfg.shortlist, 1)
    speed = measure_speed(test, reader, shortlist, naive, workers)
    rows = speed_rows(speed, workers)
    facts = {
        "pictures": f"{count} pairs of the embedded street, {size[1]} x {size[0]}, rendered {ENLARGED} times smaller",
        "matcher": dict(matchers[0].matcher.settings),
        "shortlist": shortlist,
        "workers": workers,
        "device": processor_name(cpu),
        "versions": versions(),
        "commit": git_commit(),
    }
    write_json(out / "driving_speed.json", {"rows": rows, "speed": asdict(speed), "protocol": facts})
    page = speed_page(speed, rows, facts)
    write_text(out / "driving_speed.md", page)
    print("\n".join(f"{row['way']}: {row['minutes']:.1f} minutes" for row in rows))


if __name__ == "__main__":
    main()
