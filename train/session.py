"""What every training command does with its configuration: photos, pairs, run folder, loop."""

import datetime
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import pick_device, plain
from diffnav.data.pairs import TrainingPairs, WholePairs
from diffnav.data.photos import Photo
from diffnav.data.splits import split_photos
from diffnav.data.store import PhotoStore
from diffnav.errors import UserError
from diffnav.training.distributed import Crew, join_crew, leave_crew
from diffnav.training.loop import fit
from diffnav.training.run import Run
from diffnav.training.stages import Stage
from diffnav.training.validation import Validation

# Settings that no result depends on: they may change when a run is resumed.
NEUTRAL = frozenset(
    {"device", "run", "paths.runs", "training.log_every", "training.validate_every", "training.save_every"}
    | {"training.workers", "experiment"}
)


def train(cfg: DictConfig, make_stage: Callable[[DictConfig], Stage]) -> dict[str, float]:
    """Train the stage that `make_stage` builds, as `cfg` says; the figures of the last validation."""
    if cfg.precision not in ("float32", "bf16"):
        raise UserError(f"precision must be float32 or bf16, got {cfg.precision!r}")
    device = pick_device(cfg.device)
    crew = join_crew(device)
    try:
        torch.manual_seed(cfg.seed)
        stage = make_stage(cfg).to(device, memory_format=torch.channels_last)
        run = open_run(cfg, stage.name, crew)
        pairs, validation = make_data(cfg, progress=crew.leads)
        if cfg.compile:
            compile_stage(stage, device)
        trained = [p for p in stage.parameters() if p.requires_grad]
        optimiser = instantiate(cfg.optimiser)(trained)
        plan, schedule = instantiate(cfg.training), instantiate(cfg.schedule)
        try:
            figures = fit(stage, pairs, optimiser, schedule, plan, run, validation, crew)
        finally:
            run.close()
        if crew.leads:
            scores = ", ".join(f"{name} {value:.4g}" for name, value in figures.items())
            print(f"{run.folder}: {plan.steps} steps done; validation: {scores or 'as before'}")
        return figures
    finally:
        leave_crew(crew)


def open_run(cfg: DictConfig, stage: str, crew: Crew) -> Run:
    """The run's folder, made by the leading process; the others wait and then read it."""
    name = cfg.run or f"{stage}-{datetime.datetime.now():%Y%m%d-%H%M%S}"
    if crew.size > 1 and not cfg.run:
        raise UserError("give run=NAME when several processes train together")
    extendable = getattr(instantiate(cfg.schedule), "extendable", False)
    neutral = NEUTRAL | ({"training.steps"} if extendable else frozenset())
    folder = Path(cfg.paths.runs).expanduser() / name
    if not crew.leads:
        crew.wait()
    run = Run(folder, plain(cfg), neutral)
    if crew.leads:
        crew.wait()
        print(f"run folder: {folder}")
    return run


def make_data(cfg: DictConfig, progress: bool) -> tuple[TrainingPairs, Validation]:
    """Training patches and the fixed validation set; photos that cannot be used are named and left out."""
    photos: list[Photo] = instantiate(cfg.data.photos)
    training, validation = split_photos(photos, **cfg.data.split)
    # Every n-th, so that a small set still sees all validation sources.
    validation = validation[:: max(1, -(-len(validation) // cfg.validation.photos))]
    size = tuple(cfg.data.size) if cfg.data.size else None
    stores = [PhotoStore(side, size, cfg.data.patch, progress) for side in (training, validation)]
    for problem in (problem for store in stores for problem in store.problems if progress):
        print(f"left out: {problem}", file=sys.stderr)
    darkness = instantiate(cfg.darkness)
    pairs = TrainingPairs(stores[0], darkness, cfg.data.patch, cfg.seed, cfg.data.augment_darkness)
    crop = tuple(cfg.validation.crop) if cfg.validation.crop else None
    return pairs, Validation(WholePairs(stores[1], darkness, cfg.validation.seed, crop))


def compile_stage(stage: Stage, device: torch.device) -> None:
    """Compile the stage in place. Raises: UserError where a CPU has no C++ compiler."""
    if device.type == "cpu" and not any(shutil.which(name) for name in ("c++", "g++", "clang++")):
        raise UserError("compile=true needs a C++ compiler, and none is installed: install g++ or leave compile=false")
    stage.compile()
