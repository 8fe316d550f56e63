"""What tests of training share: small pictures, networks of four channels, the loop over them, a run's tables."""

import csv
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import Dataset

from diffnav.losses.retinex import RetinexLoss
from diffnav.retinex.enhancer import DirectEnhancer, RetinexEnhancer
from diffnav.training.loop import Plan, fit
from diffnav.training.run import Run
from diffnav.training.schedules import Constant, OneCycle
from diffnav.training.stages import DirectStage, EnhanceStage, Stage
from diffnav.training.validation import Validation

REPOSITORY = Path(__file__).parents[2]
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}


def picture(seed: int, height: int, width: int) -> np.ndarray:
    """(height, width, 3) uint8: smooth colours with hard edges."""
    dice = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    waves = [np.sin(x / dice.uniform(3, 20) + y / dice.uniform(3, 20) + dice.uniform(0, 6)) for _ in range(3)]
    blocks = dice.uniform(-0.3, 0.3, (height // 8 + 1, width // 8 + 1)).repeat(8, 0).repeat(8, 1)
    levels = 0.55 + 0.2 * np.stack(waves, 2) + blocks[:height, :width, None]
    return (levels.clip(0, 1) * 255).astype(np.uint8)


def rows(table: Path) -> list[dict[str, str]]:
    """The rows of a CSV file, without the throughput, which no two runs share."""
    with table.open(newline="") as file:
        found = list(csv.DictReader(file))
    return [{key: value for key, value in row.items() if key != "images_per_second"} for row in found]


class Patches(Dataset):
    """Sample number -> a dark and a daylight patch of 16 x 16, drawn from the number."""

    def __getitem__(self, number: int) -> dict[str, Tensor]:
        levels = torch.randint(256, (3, 16, 16), generator=torch.Generator().manual_seed(number))
        normal = levels / 255
        return {"low": normal**4, "normal": normal}

    def __len__(self) -> int:
        return 4


def make_stage(kind: type[Stage] = EnhanceStage, **settings) -> Stage:
    torch.manual_seed(0)
    network = DirectEnhancer if kind is DirectStage else RetinexEnhancer
    return kind(network(width=4), RetinexLoss(), **settings)


def train(
    folder: Path,
    stage: Stage | None = None,
    optimiser: Callable = torch.optim.Adam,
    schedule: Constant | OneCycle | None = None,
    validate: Validation | None = None,
    **plan,
) -> Stage:
    """The stage after a few steps at a rate of .01."""
    stage = stage or make_stage()
    trained = [p for p in stage.parameters() if p.requires_grad]
    plan = {"steps": 4, "batch": 4, "log_every": 1} | plan
    fit(stage, Patches(), optimiser(trained, lr=0.01), schedule or Constant(), Plan(**plan), Run(folder, {}), validate)
    return stage


def column(folder: Path, name: str, table: str = "metrics") -> list[float]:
    with (folder / f"{table}.csv").open(newline="") as file:
        return [float(row[name]) for row in csv.DictReader(file)]


def weights(stage: Stage) -> Tensor:
    return torch.nn.utils.parameters_to_vector(stage.parameters()).detach()
