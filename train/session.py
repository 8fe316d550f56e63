"""What every training command does with its configuration: photos, pairs, run folder, loop."""

import datetime
import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig
from torch.utils.data import Dataset

from conf.command import choice, photos_of, pick_device, picture_size, plain, whole_number
from diffnav.darkness import DarknessModel
from diffnav.data.pairs import TrainingPairs, WholePairs
from diffnav.data.photos import Photo
from diffnav.data.splits import split_photos, thin_photos
from diffnav.data.store import PhotoStore
from diffnav.errors import UserError
from diffnav.training.allocator import keep_freed_memory
from diffnav.training.distributed import Crew, join_crew, leave_crew
from diffnav.training.loop import fit
from diffnav.training.run import Run
from diffnav.training.stages import Stage
from diffnav.training.validation import Validation

# Settings that no result depends on: they may change when a run is resumed.
NEUTRAL = frozenset(
    {"device", "run", "paths.runs", "training.log_every", "training.validate_every", "training.save_every"}
    # data.root is only a short name for data.photos.root, which is compared.
    | {"training.workers", "experiment", "data.root"}
)


def train(
    cfg: DictConfig,
    make_stage: Callable[[DictConfig], Stage],
    make_pairs: Callable[[DictConfig, TrainingPairs], Dataset] = lambda _, pairs: pairs,
) -> dict[str, float]:
    """Train the stage that `make_stage` builds, as `cfg` says; the figures of the last validation.

    make_pairs: from the training pairs to the samples that the stage takes.
    """
    device = pick_device(cfg.device)
    crew = join_crew(device)
    try:
        keep_freed_memory()
        torch.manual_seed(whole_number("seed", cfg.seed, 0))
        stage = make_stage(cfg).to(device, memory_format=torch.channels_last)
        plan, schedule = instantiate(cfg.training), instantiate(cfg.schedule)
        pairs, validation = make_data(cfg, progress=crew.leads)
        run = open_run(cfg, stage.name, crew)
        if cfg.compile:
            compile_stage(stage, device)
        trained = [p for p in stage.parameters() if p.requires_grad]
        optimiser = instantiate(cfg.optimiser)(trained)
        try:
            figures = fit(stage, make_pairs(cfg, pairs), optimiser, schedule, plan, run, validation, crew)
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
    name = str(cfg.run or f"{stage}-{datetime.datetime.now():%Y%m%d-%H%M%S}")
    if crew.size > 1 and not cfg.run:
        raise UserError("give run=NAME when several processes train together")
    extendable = getattr(instantiate(cfg.schedule), "extendable", False)
    neutral = NEUTRAL | ({"training.steps"} if extendable else frozenset())
    folder = Path(cfg.paths.runs).expanduser() / name
    if not crew.leads:
        crew.wait()
    run = Run(folder, plain(cfg), neutral, writes=crew.leads)
    if crew.leads:
        crew.wait()
        print(f"run folder: {folder}")
    return run


def make_data(cfg: DictConfig, progress: bool) -> tuple[TrainingPairs, Validation]:
    """Training patches and the fixed validation set; photos that cannot be used are named and left out."""
    darkness: DarknessModel = instantiate(cfg.darkness)
    photos: list[Photo] = instantiate(photos_of(cfg))
    training, validation = split_photos(photos, **cfg.data.split)
    validation = thin_photos(validation, whole_number("validation.photos", cfg.validation.photos, 1))
    patch = whole_number("data.patch", cfg.data.patch, 16)
    size = picture_size("data.size", cfg.data.size)
    crop = picture_size("validation.crop", cfg.validation.crop)
    stores = [PhotoStore(side, size, patch, progress) for side in (training, validation)]
    for problem in (problem for store in stores for problem in store.problems if progress):
        print(f"left out: {problem}", file=sys.stderr)
    variation = instantiate(cfg.data.variation)
    pairs = TrainingPairs(stores[0], darkness, patch, cfg.seed, cfg.data.augment_darkness, variation)
    matchers = [instantiate(choice("matcher", name)) for name in cfg.validation.matchers]
    return pairs, Validation(WholePairs(stores[1], darkness, cfg.validation.seed, crop), matchers)


def compile_stage(stage: Stage, device: torch.device) -> None:
    """Compile the stage in place. Raises: UserError where torch.compile's compiler is not installed."""
    if device.type == "cpu":
        variable, names = "CXX", [os.environ.get("CXX", "clang++" if sys.platform == "darwin" else "g++")]
    else:
        variable, names = "CC", [os.environ["CC"]] if "CC" in os.environ else ["gcc", "clang"]
    if not any(shutil.which(name) for name in names):
        raise UserError(
            f"compile=true needs the compiler {' or '.join(names)}, which is not installed: install it, "
            f"name another in the environment variable {variable}, or leave compile=false"
        )
    stage.compile()
