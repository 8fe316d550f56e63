"""python -m train.darken images=/folder out=/folder: a paired data set, darkened the paper's way."""

import sys

from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import command, picture_size, plain
from diffnav.data.writing import PairSettings, write_pairs


@command("darken")
def main(cfg: DictConfig) -> None:
    given = plain(cfg)
    size = picture_size("size", given["size"])
    settings = PairSettings(instantiate(cfg.darkness), size, given["seed"], given["quality"])
    done = write_pairs(instantiate(cfg.photos), given["images"], given["out"], settings, progress=True)
    for problem in done.problems:
        print(f"left out: {problem}", file=sys.stderr)
    print(f"{cfg.out}: {done.written} pairs written, {done.kept} already there, {len(done.problems)} left out")


if __name__ == "__main__":
    main()
