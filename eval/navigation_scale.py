"""python -m eval.navigation_scale: how a search for places scales from nine tiles to a hundred thousand."""

from dataclasses import asdict
from pathlib import Path

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import command, whole_number
from diffnav.evaluation.navigation.scale import ScaleRecord, ScaleStudy, measure_scale
from diffnav.evaluation.navigation.scale_page import (
    scale_page,
    scale_rows,
    scale_table,
    scale_targets,
    write_scale_plot,
)
from diffnav.evaluation.navigation.simulated_tiles import IN_WORDS, resemblance
from diffnav.evaluation.provenance import git_commit, processor_name, versions
from diffnav.evaluation.records import RecordLog
from diffnav.evaluation.tables import write_json, write_text
from diffnav.navigation.faiss_index import faiss_version
from eval.session import plain_list


@command("navigation_scale")
def main(cfg: DictConfig) -> None:
    out = Path(str(cfg.out)).expanduser()
    study: ScaleStudy = instantiate(cfg.study, _convert_="all")
    counts = [whole_number("counts", count, 1) for count in plain_list(cfg.counts)]
    log = RecordLog(out / "records.jsonl", ScaleRecord)
    before = len(log.keys)
    rows = scale_rows(measure_scale(study, counts, log, progress=True))
    targets = scale_targets(rows)
    settings = asdict(study)
    del settings["maps"]["cache"]
    facts = {
        **settings,
        "simulated": IN_WORDS,
        "nearest_descriptor_of_another_place": resemblance(study.maps.pool_tiles(), study.maps.seed),
        "device": processor_name(torch.device("cpu")),
        "versions": versions() | {"faiss": faiss_version()},
        "commit": git_commit(),
    }
    write_json(out / "navigation_scale.json", {"rows": rows, "targets": targets, "protocol": facts})
    write_text(out / "navigation_scale.md", scale_page(rows, targets, facts))
    write_scale_plot(out / "scale.png", rows)
    print(f"{scale_table(rows)}\n{out}: {len(log.keys) - before} measurements made now, {before} before")


if __name__ == "__main__":
    main()
