"""python -m eval.spectrum: which spatial frequencies of the daylight picture does an enhanced picture still hold?"""

import sys
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import command, pick_device
from diffnav.data.pair_source import PairSource
from diffnav.evaluation.cells import failure_lines
from diffnav.evaluation.predictions import PredictionCache
from diffnav.evaluation.runner import Runner
from diffnav.evaluation.spectrum import measure_spectra, spectrum_rows
from diffnav.evaluation.spectrum_page import bands_table, spectrum_page, write_spectrum_plot
from diffnav.evaluation.tables import write_csv, write_json, write_text
from eval.session import make_methods, make_photos, plain_list, protocol


@command("spectrum")
def main(cfg: DictConfig) -> None:
    device, out = pick_device(cfg.device), Path(str(cfg.out)).expanduser()
    methods, photos = make_methods(cfg, device), make_photos(cfg)
    source = PairSource(photos, instantiate(cfg.darkness), cfg.seed, tuple(plain_list(cfg.data.size)) or None)
    cache = PredictionCache(Path(str(cfg.cache)).expanduser() if cfg.cache else None)

    measured = measure_spectra(source, [Runner(method, cache) for method in methods], progress=True)
    rows = spectrum_rows(measured.records, cfg.seed)
    for problem in measured.problems:
        print(f"left out: {problem}", file=sys.stderr)
    for failure in failure_lines(rows):
        print(f"failed: {failure}", file=sys.stderr)
    facts = protocol(cfg, device, methods, photos)
    facts |= {"n": max(row["n"] for row in rows), "left_out": measured.problems}
    write_csv(out / "spectrum.csv", [line for record in measured.records for line in record.flat()])
    write_json(out / "spectrum.json", {"rows": rows, "protocol": facts})
    write_text(out / "spectrum.md", spectrum_page(rows, facts))
    write_spectrum_plot(out / "spectrum.png", rows)
    print(bands_table(rows, "coherence"))
    print(f"{out}: {len(rows)} rows over {facts['n']} photos")


if __name__ == "__main__":
    main()
