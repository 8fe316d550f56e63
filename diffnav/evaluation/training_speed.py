"""A training step, timed phase by phase: the training loop's own pieces on pictures in memory."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import torch
from torch import Tensor, nn
from torch.utils.data import Dataset

from diffnav.darkness import DarknessModel
from diffnav.data.match_pairs.random_views import RandomViews
from diffnav.data.pairs import TrainingPairs
from diffnav.data.photos import Photo
from diffnav.data.scenes import SceneWindows
from diffnav.data.store import PhotoStore
from diffnav.data.viewed_pairs import ViewedPairs
from diffnav.evaluation.memory import peak_memory_gb
from diffnav.evaluation.timing import PhaseClock, Seconds
from diffnav.losses.hybrid import HybridLoss
from diffnav.losses.retinex import RetinexLoss
from diffnav.matching.descriptors.descriptor import Descriptor
from diffnav.retinex.enhancer import RetinexEnhancer
from diffnav.training.allocator import keep_freed_memory
from diffnav.training.distributed import Crew
from diffnav.training.finetune import FinetuneStage
from diffnav.training.loop import Batch, Plan, _batches, _optimise
from diffnav.training.stages import DecomStage, EnhanceStage, Figures, Losses, Stage


@dataclass(frozen=True)
class TrainingSetup:
    """What all timed trainings share. optimiser: parameters -> optimiser. batch: patches a step.

    recipes: name -> a matcher-aware loss that is timed beside the paper's; descriptors: of those that need any.
    """

    store: PhotoStore
    darkness: DarknessModel
    loss: RetinexLoss
    decom_loss: RetinexLoss
    optimiser: Callable[..., torch.optim.Optimizer]
    batch: int = 8
    patch: int = 96
    clip_norm: float = 1.0
    recipes: Mapping[str, HybridLoss] = field(default_factory=dict)
    descriptors: Mapping[str, Descriptor] = field(default_factory=dict)


@dataclass(frozen=True)
class TrainingCase:
    """One row: the network (its name and settings), the stage (joint or decom), bf16 or float32, compiled or not.

    recipe: name of the matcher-aware loss, None for the paper's.
    """

    network: str
    settings: Mapping[str, Any]
    stage: str
    bf16: bool = False
    compiled: bool = False
    recipe: str | None = None

    @property
    def precision(self) -> str:
        return "bf16" if self.bf16 else "float32"

    @property
    def name(self) -> str:
        words = [self.network, self.stage, self.precision, "compiled" if self.compiled else "", self.recipe or ""]
        return " ".join(word for word in words if word)

    def make_stage(self, setup: TrainingSetup) -> Stage:
        """The stage with fresh weights: speed does not depend on them."""
        enhancer = RetinexEnhancer(**self.settings)
        if self.stage == "decom":
            return DecomStage(enhancer, setup.loss, self.bf16)
        loss = setup.recipes[self.recipe] if self.recipe else setup.loss
        joint = EnhanceStage(enhancer, loss, self.bf16, train_decom=True, decom_loss=setup.decom_loss)
        return FinetuneStage(joint, loss, setup.descriptors) if isinstance(loss, HybridLoss) else joint

    def make_pairs(self, setup: TrainingSetup) -> Dataset:
        """The samples that the stage takes."""
        pairs = TrainingPairs(setup.store, setup.darkness, setup.patch)
        return ViewedPairs(pairs, RandomViews(scale=(0.8, 1.25), perspective=0.05)) if self.recipe else pairs


class TimedStage(nn.Module):
    """A stage that tells the clock when its networks and losses begin and end."""

    def __init__(self, stage: Stage, clock: PhaseClock) -> None:
        super().__init__()
        self.stage = stage
        self.clock = clock

    def forward(self, **batch: Tensor) -> tuple[Losses, Figures]:
        self.clock.mark("forward")
        result = self.stage(**batch)
        self.clock.mark("backward")
        return result


class TrainingTimer:
    """Takes one training step at a time, at most `steps`; `run` gives the seconds of its phases.

    data: batch from memory to device. forward: networks and losses. backward: gradients, checked and clipped.
    optimiser: its step. other: the rest. Logging, validation and saving, every n-th step, are not in it.
    """

    def __init__(
        self,
        case: TrainingCase,
        setup: TrainingSetup,
        device: torch.device,
        steps: int,
        compile_stage: Callable[[Stage, torch.device], None] | None = None,
    ) -> None:
        self.name = case.name
        self._clock = PhaseClock(device)
        stage = case.make_stage(setup).train()
        stage.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]
        if case.compiled and compile_stage is not None:
            compile_stage(stage, device)
        self._stage = TimedStage(stage, self._clock)
        self._optimiser = setup.optimiser([p for p in stage.parameters() if p.requires_grad])
        self._optimiser.register_step_pre_hook(lambda *_: self._clock.mark("optimiser"))
        self._optimiser.register_step_post_hook(lambda *_: self._clock.mark("other"))
        self._plan = Plan(steps, setup.batch, clip_norm=setup.clip_norm)
        self._batches: Iterator[Batch] = _batches(case.make_pairs(setup), self._plan, 0, Crew(), device)

    def run(self) -> Seconds:
        """Take one step: seconds of each phase."""
        self._clock.start("data")
        batch = next(self._batches)
        self._clock.mark("other")
        _optimise(self._stage, batch, self._optimiser, self._plan, 0)
        return self._clock.stop()


def training_memory_gb(
    case: TrainingCase, setup: TrainingSetup, device: torch.device, steps: int, threads: int
) -> float:
    """Peak memory of a process that takes a few steps; to be called in one of its own."""
    keep_freed_memory()
    torch.set_num_threads(threads)
    timer = TrainingTimer(case, setup, device, steps)
    for _ in range(steps):
        timer.run()
    return peak_memory_gb(device)


def scenery_store(count: int, size: tuple[int, int], seed: int = 0) -> PhotoStore:
    """`count` windows (h, w) of the embedded world, in memory as training holds photographs."""
    windows = SceneWindows(seed, count, size).windows
    photos = [Photo(window.name, window.name, window.render) for window in windows]
    return PhotoStore(photos, None, smallest=1)
