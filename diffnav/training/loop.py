"""The one training loop, read top to bottom: batch, loss, backward, clip, step, log, validate, save."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.utils.data import DataLoader, Dataset
from tqdm import tqdm

from diffnav.errors import UserError
from diffnav.training.distributed import Crew
from diffnav.training.run import Run
from diffnav.training.schedules import Constant, OneCycle
from diffnav.training.signals import stop_requested
from diffnav.training.stages import Stage
from diffnav.training.validation import Validation

Batch = dict[str, Tensor]


@dataclass(frozen=True)
class Plan:
    """How long and in what portions to train.

    batch: samples per optimiser step over all processes. accumulate: forward passes a batch is cut into.
    clip_norm: bound on the gradient's norm, None for no clipping. *_every: steps between logs, validations,
    saves. workers: processes that prepare batches; 0 prepares them in the training process.
    """

    steps: int
    batch: int = 16
    accumulate: int = 1
    clip_norm: float | None = None
    log_every: int = 10
    validate_every: int = 500
    save_every: int = 200
    workers: int = 0

    def __post_init__(self) -> None:
        for name in ("steps", "batch", "accumulate", "log_every", "validate_every", "save_every"):
            value = getattr(self, name)
            if not isinstance(value, int) or value < 1:
                raise UserError(f"training.{name} must be a whole number of 1 or more, got {value!r}")
        if self.workers < 0:
            raise UserError(f"training.workers must be 0 or more, got {self.workers}")
        if self.clip_norm is not None and self.clip_norm <= 0:
            raise UserError(f"training.clip_norm must be above 0, or null for no clipping; got {self.clip_norm}")


class Interrupted(UserError):  # noqa: N818 - not an error of anybody's
    """The run was stopped from outside (Ctrl-C, SIGTERM) and is saved."""


def fit(
    stage: Stage,
    pairs: Dataset,
    optimiser: torch.optim.Optimizer,
    schedule: Constant | OneCycle,
    plan: Plan,
    run: Run,
    validate: Validation | None = None,
    crew: Crew | None = None,
) -> dict[str, float]:
    """Train `stage` to `plan.steps`, resuming where `run` stands; the figures of the last validation.

    Given the same run folder, the result does not depend on how often the process was stopped in between. The best
    step is the one of most correct matches where the validation counts them, else of the highest PSNR.

    Raises: UserError naming step, term and batch when a loss is not finite; Interrupted after Ctrl-C.
    """
    crew = crew or Crew()
    step, best = run.restore(stage, optimiser)
    wrapped = crew.wrap(stage).train()
    validated: dict[str, float] = {}
    watch = Stopwatch(plan.batch)
    bar = tqdm(total=plan.steps, initial=step, desc=stage.name, unit="step", disable=not crew.leads, mininterval=1.0)
    with stop_requested() as stopping, bar:
        for batch in _batches(pairs, plan, step, crew, _device(stage)):
            for group in optimiser.param_groups:
                group["lr"] = group.setdefault("initial_lr", group["lr"]) * schedule.factor(step, plan.steps)
            figures = _optimise(wrapped, batch, optimiser, plan, step)
            step += 1
            watch.tick()
            bar.update()

            done = step == plan.steps
            stop = crew.any(stopping()) and not done
            if step % plan.log_every == 0 or done:
                row = {name: crew.mean(value).item() for name, value in figures.items()}
                if crew.leads:
                    row |= {
                        "learning_rate": optimiser.param_groups[0]["lr"],
                        "images_per_second": watch.rate(),
                    }
                    run.log("metrics", step, row)
                    bar.set_postfix(loss=f"{row['total']:.4g}", psnr=f"{validated.get('psnr', math.nan):.2f}")
            if validate and crew.leads and (step % plan.validate_every == 0 or done):
                validated, pictures = validate(stage)
                run.log("validation", step, validated)
                run.draw("validation", step, pictures)
                score = validated.get("correct", validated["psnr"])
                if score > best:
                    best = score
                    run.save_weights("best", stage, step)
                watch.restart()
            if crew.leads and (step % plan.save_every == 0 or done or stop):
                run.save(stage, optimiser, step, best)
            if stop:
                crew.wait()
                raise Interrupted(
                    f"stopped at step {step} of {plan.steps} and saved; "
                    f"the same command with run={run.folder.name} goes on from there"
                )
    return validated


def _optimise(
    wrapped: nn.Module, batch: Batch, optimiser: torch.optim.Optimizer, plan: Plan, step: int
) -> dict[str, Tensor]:
    """One optimiser step; every named loss, their total and the figures to watch, as scalars."""
    optimiser.zero_grad(set_to_none=True)
    means: dict[str, Tensor] = {}
    portions = {key: values.chunk(plan.accumulate) for key, values in batch.items()}
    for part in range(plan.accumulate):
        losses, figures = wrapped(**{key: values[part] for key, values in portions.items()})
        total = torch.stack(list(losses.values())).sum()
        _require_finite({f"loss '{name}'": value for name, value in losses.items()}, step, plan)
        (total / plan.accumulate).backward()
        for name, value in (losses | {"total": total} | figures).items():
            means[name] = means.get(name, 0) + value.detach() / plan.accumulate
    # An infinite bound clips nothing; the norm is needed to keep a bad gradient out of the weights.
    bound = math.inf if plan.clip_norm is None else plan.clip_norm
    norm = torch.nn.utils.clip_grad_norm_(wrapped.parameters(), bound)
    _require_finite({"gradient norm": norm}, step, plan)
    optimiser.step()
    return means


def _require_finite(values: dict[str, Tensor], step: int, plan: Plan) -> None:
    """Raise UserError, naming step, term and batch, where a loss or the gradient is NaN or infinite."""
    for name, value in values.items():
        if not torch.isfinite(value):
            first = step * plan.batch
            raise UserError(
                f"the {name} became {value.item()} at step {step + 1}, in the batch of samples {first} to "
                f"{first + plan.batch - 1}; lower optimiser.lr, or set training.clip_norm"
            )


def _batches(pairs: Dataset, plan: Plan, step: int, crew: Crew, device: torch.device) -> Iterator[Batch]:
    """The batches of the remaining steps; each process takes its share of every batch."""
    share = plan.batch // crew.size
    if share * crew.size != plan.batch or share % plan.accumulate:
        raise UserError(
            f"training.batch is {plan.batch}, which {crew.size} processes x accumulate={plan.accumulate} do not divide"
        )
    starts = (s * plan.batch + crew.rank * share for s in range(step, plan.steps))
    loader = DataLoader(
        pairs,
        batch_sampler=[list(range(start, start + share)) for start in starts],
        num_workers=plan.workers,
        pin_memory=device.type == "cuda",
    )
    for batch in loader:
        yield {key: values.to(device, non_blocking=True) for key, values in batch.items()}


def _device(stage: nn.Module) -> torch.device:
    return next(stage.parameters()).device


class Stopwatch:
    """Samples per second since the last reading."""

    def __init__(self, batch: int) -> None:
        self.batch = batch
        self.restart()

    def restart(self) -> None:
        self._steps, self._since = 0, time.perf_counter()

    def tick(self) -> None:
        self._steps += 1

    def rate(self) -> float:
        """Samples per second, and a new start."""
        rate = self._steps * self.batch / (time.perf_counter() - self._since)
        self.restart()
        return rate
