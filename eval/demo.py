"""python -m eval.demo: a few minutes of training, Table 1, matching, and one page that shows them."""

import json
import shlex
import subprocess
import sys
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig
from tqdm import tqdm

from conf.command import choice, command, pick_device
from diffnav.darkness import DarknessModel
from diffnav.data.photos import folder_photos
from diffnav.data.scenes import SceneWindows
from diffnav.errors import UserError
from diffnav.evaluation.demo_page import demo_page
from diffnav.evaluation.enhancement import PairSource
from diffnav.evaluation.rotated_matching import match_rotated
from diffnav.images import write_image
from diffnav.retinex.checkpoints import load_enhancer


def scenery(folder: Path, seed: int, count: int) -> Path:
    """A folder of `count` windows of the embedded world; what is already there is kept."""
    windows = SceneWindows(seed, count)
    for index, window in enumerate(tqdm(windows.windows, desc="rendering scenery", unit="picture")):
        path = folder / f"{window.name}.png"
        if not path.exists():
            write_image(path, windows[index][1])
    return folder


def run(arguments: list[str], said: list[str]) -> None:
    """Run one of the kit's commands as a user would, and note it in `said`."""
    said.append(shlex.join(["python", "-m", *arguments]))
    print(f"\n$ {said[-1]}", flush=True)
    if subprocess.run([sys.executable, "-m", *arguments]).returncode:
        raise UserError(f"the demo stops, for this command failed: {said[-1]}")


def quoted(value: object) -> str:
    """A value as Hydra reads it, whatever it holds."""
    return json.dumps(str(value))


@command("demo")
def main(cfg: DictConfig) -> None:
    out = Path(cfg.out).expanduser()
    pick_device(cfg.device)
    own = cfg.data.root is not None
    training = Path(cfg.data.root).expanduser() if own else scenery(out / "photos" / "train", cfg.seed, cfg.scenes)
    testing = training if own else scenery(out / "photos" / "test", cfg.seed + 1, cfg.photos)
    every = folder_photos(testing)
    photos = every[:: -(-len(every) // cfg.photos)]
    said: list[str] = []
    name = f"trained-on-{cfg.init}"
    run(
        ["train.enhance", "experiment=demo", f"run={name}", f"paths.runs={quoted(out)}", f"init={quoted(cfg.init)}"]
        + ["data=folder", f"data.root={quoted(training)}", f"training.steps={cfg.steps}", f"device={cfg.device}"]
        + [f"training.batch={cfg.batch}", f"seed={cfg.seed}"],
        said,
    )
    checkpoints = [*cfg.checkpoints, str(out / name / "last.pt")]
    run(
        ["eval.enhancement", f"checkpoint=[{','.join(map(quoted, checkpoints))}]", f"data.root={quoted(testing)}"]
        + [f"limit={cfg.photos}", f"out={quoted(out / 'enhancement')}", f"device={cfg.device}", f"seed={cfg.seed}"],
        said,
    )
    rows = json.loads((out / "enhancement" / "enhancement.json").read_text())["rows"]
    source = PairSource(photos, DarknessModel(), cfg.seed)
    enhancers = {row["method"]: None for row in rows} | {"normal": None}
    for method in enhancers:
        found = next((c for c in checkpoints if method in (c, Path(c).parent.name)), None)
        enhancers[method] = load_enhancer(found) if found else instantiate(choice("enhancer", method))
    matcher = instantiate(cfg.matcher)
    pairs = [source.read(photo) for photo in photos]
    matched = [match_rotated(pair, enhancers, matcher) for pair in tqdm(pairs, desc="matching", unit="picture")]
    origin = f"from {training}" if own else "of the embedded world"
    shown = ["input", *cfg.checkpoints, "normal"]
    page = demo_page(rows, matched, out / name / "metrics.csv", shown, said, origin)
    page.write(out / "report.html")
    print(f"\n{out / 'report.html'}: open it in a browser")


if __name__ == "__main__":
    main()
