"""python -m eval.demo: a few minutes of training, Table 1, matching, and one page that shows them."""

import json
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig
from tqdm import tqdm

from conf.command import choice, command, pick_device
from diffnav.checkpoints import load_enhancer
from diffnav.darkness import DarknessModel
from diffnav.data.match_pairs.rot180 import Rot180Pairs
from diffnav.data.pair_source import PairSource
from diffnav.data.photos import folder_photos
from diffnav.data.scenes import SceneWindows
from diffnav.data.splits import thin_photos
from diffnav.evaluation.demo_page import demo_page
from diffnav.evaluation.match_case import match_enhanced
from diffnav.images import write_image
from eval.calls import call


@command("demo")
def main(cfg: DictConfig) -> None:
    pick_device(cfg.device)
    out = Path(cfg.out).expanduser()
    training, testing = picture_folders(cfg, out)
    every = folder_photos(testing)
    run = f"trained_on_{cfg.init}"
    common = {"device": cfg.device, "seed": cfg.seed}
    train = {"experiment": "demo", "paths.runs": str(out), "run": run, "init": cfg.init, "data.root": str(training)}
    lines = [call("train.enhance", {**train, "training.steps": cfg.steps, **common})]
    checkpoints = {Path(c).name: c for c in [*cfg.checkpoints, str(out / run)]}
    table = {"checkpoint": list(checkpoints.values()), "data": "folder", "data.root": str(testing), "limit": cfg.photos}
    lines += [call("eval.enhancement", {**table, "out": str(out / "enhancement"), **common})]
    lines += [f'python -m eval.photos images="{testing}" out=bright/ checkpoint={cfg.init}']

    rows = json.loads((out / "enhancement" / "enhancement.json").read_text())["rows"]
    enhancers = {name: instantiate(choice("enhancer", name)) for name in cfg.enhancers}
    enhancers |= {name: load_enhancer(checkpoint) for name, checkpoint in checkpoints.items()}
    source = Rot180Pairs(PairSource(every, DarknessModel(), cfg.seed, tuple(cfg.size)))
    matcher = instantiate(cfg.matcher)
    pairs = [source.read(photo) for photo in thin_photos(every, cfg.photos)]
    matched = [match_enhanced(pair, enhancers, matcher) for pair in tqdm(pairs, desc="matching", unit="picture")]

    origin = str(testing) if cfg.data.root else "the embedded world"
    shown = ["input", *list(checkpoints)[:-1], "normal"]
    demo_page(rows, matched, out / run / "metrics.csv", shown, lines, origin).write(out / "report.html")
    print(f"\n{out / 'report.html'}: open it in a browser")


def picture_folders(cfg: DictConfig, out: Path) -> tuple[Path, Path]:
    """Where the pictures to train on and to measure on lie; the embedded world's are rendered first."""
    if cfg.data.root is not None:
        return Path(cfg.data.root).expanduser(), Path(cfg.data.root).expanduser()
    for place, (name, count) in enumerate({"train": cfg.scenes, "test": cfg.photos}.items()):
        windows = SceneWindows(cfg.seed + place, count)
        for index in tqdm(range(count), desc=f"rendering {name} scenery", unit="picture"):
            write_image(out / "scenery" / name / f"{windows.windows[index].name}.png", windows[index][1])
    return out / "scenery" / "train", out / "scenery" / "test"


if __name__ == "__main__":
    main()
