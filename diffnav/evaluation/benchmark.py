"""How fast and how large: training steps, inference and one large picture, side by side in one run."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from tqdm import tqdm

from diffnav.errors import UserError
from diffnav.evaluation.inference_speed import (
    InferenceCase,
    Size,
    backend_versions,
    inference_rows,
    inference_timers,
    large_image,
)
from diffnav.evaluation.memory import in_own_process
from diffnav.evaluation.provenance import device_name, versions
from diffnav.evaluation.timing import PHASES, Seconds, Timer, interleave
from diffnav.evaluation.training_speed import TrainingCase, TrainingSetup, TrainingTimer, training_memory_gb
from diffnav.training.stages import Stage

# Of these phases a step should consist, but for `OUTSIDE_LIMIT` of its time.
_INSIDE = ("forward", "backward", "optimiser")
OUTSIDE_LIMIT = 0.10
LARGE_LIMIT_GB = 3.0
# Of a step of the light recipe, against the same step with the paper's loss.
LIGHT_RECIPE, LIGHT_LIMIT = "hybrid_light", 1.6
_MEMORY_STEPS = 2

Row = dict[str, Any]


@dataclass(frozen=True)
class Sizes:
    """How much is timed. repeats: timed runs of each case, after `warmup` more. Pictures are (h, w)."""

    repeats: int = 10
    warmup: int = 2
    inference: Size = (400, 600)
    large: Size = (3600, 7200)

    def __post_init__(self) -> None:
        if self.repeats < 1 or self.warmup < 0:
            raise UserError(f"repeats must be 1 or more and warmup 0 or more, got {self.repeats} and {self.warmup}")


def run_benchmark(
    networks: Mapping[str, Mapping[str, Any]],
    setup: TrainingSetup,
    sizes: Sizes,
    device: torch.device,
    compile_stage: Callable[[Stage, torch.device], None] | None = None,
    backends: Sequence[str] = (),
) -> dict[str, Any]:
    """All figures as plain values: `environment`, `settings`, `training`, `inference`, `large_image`, `targets`.

    Args:
        networks: name -> settings; the first is what the others are compared with, and enhances the large picture.
        compile_stage: compiles a stage in place; given, a compiled training step is timed too.
        backends: compile, onnxruntime: what enhances too; `left_out` has a sentence on each that cannot.
    """
    environment = _environment(device)
    main = next(iter(networks))
    training = _training_cases(networks, main, compile_stage is not None)
    training += [TrainingCase(main, networks[main], "joint", True, recipe=recipe) for recipe in setup.recipes]
    inference, timers_of_inference, left_out = inference_timers(networks, backends, sizes.inference, device)
    steps = sizes.warmup + sizes.repeats
    timers: list[Timer] = [TrainingTimer(case, setup, device, steps, compile_stage) for case in training]
    medians = interleave([*timers, *timers_of_inference], sizes.repeats, sizes.warmup)
    memory = _memory(training, setup, device)
    large = in_own_process(large_image, inference[0], sizes.large, device, torch.get_num_threads())
    training_rows = _training_rows(training, medians, memory, setup.batch)
    rows = inference_rows(inference, medians, sizes.inference)
    large_row = _large_row(inference[0], rows[0], sizes.large, large)
    return {
        "environment": {**environment, "versions": environment["versions"] | backend_versions(inference)},
        "settings": {"batch": setup.batch, "patch": setup.patch, "repeats": sizes.repeats, "warmup": sizes.warmup},
        "training": training_rows,
        "inference": rows,
        "left_out": left_out,
        "large_image": large_row,
        "targets": _targets([row for row in training_rows if row["network"] == main], large_row),
    }


def _training_cases(networks: Mapping[str, Mapping[str, Any]], main: str, compiled: bool) -> list[TrainingCase]:
    """The joint stage of every network and Decom-Net's of the main one, each in float32 and bf16."""
    cases = [
        TrainingCase(name, settings, stage, bf16)
        for name, settings in networks.items()
        for stage in (("joint", "decom") if name == main else ("joint",))
        for bf16 in (False, True)
    ]
    return [*cases, TrainingCase(main, networks[main], "joint", compiled=True)] if compiled else cases


def _environment(device: torch.device) -> Row:
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {
        "device": device_name(device),
        "cpu": device_name(torch.device("cpu")),
        "cores": os.cpu_count(),
        "threads": torch.get_num_threads(),
        "load_before": load,
        "versions": versions(),
    }


def _memory(cases: list[TrainingCase], setup: TrainingSetup, device: torch.device) -> dict[str, float]:
    """Name -> peak memory of a few steps, each case in a process of its own; compiled ones are left out."""
    plain = [case for case in cases if not case.compiled]
    return {
        case.name: in_own_process(training_memory_gb, case, setup, device, _MEMORY_STEPS, torch.get_num_threads())
        for case in tqdm(plain, desc="measuring memory", unit="case")
    }


def _training_rows(
    cases: list[TrainingCase], medians: Mapping[str, Seconds], memory: Mapping[str, float], batch: int
) -> list[Row]:
    """One row per case; `seconds` is the sum of the phases' medians, so that shares add up to one."""
    totals = {case.name: sum(medians[case.name].values()) for case in cases}
    rows = []
    for case in cases:
        total, phases = totals[case.name], medians[case.name]
        exact = TrainingCase(case.network, case.settings, case.stage, recipe=case.recipe).name
        plain = TrainingCase(case.network, case.settings, case.stage, case.bf16).name
        rows.append(
            {
                "name": case.name,
                "network": case.network,
                "stage": case.stage,
                "precision": case.precision,
                "compiled": case.compiled,
                "recipe": case.recipe,
                "seconds": total,
                "ratio": total / totals[cases[0].name],
                "of_paper_step": total / totals[plain],
                "speedup_over_float32": totals[exact] / total if exact in totals else None,
                "images_per_second": batch / total,
                "phases": {phase: {"seconds": phases[phase], "share": phases[phase] / total} for phase in PHASES},
                "outside_share": sum(phases[phase] for phase in PHASES if phase not in _INSIDE) / total,
                "peak_memory_gb": memory.get(case.name),
            }
        )
    return rows


def _large_row(case: InferenceCase, small: Row, size: Size, figures: Mapping[str, float]) -> Row:
    per_megapixel = figures["seconds"] / (size[0] * size[1] / 1e6)
    return {
        "name": case.name,
        "size": list(size),
        "tile_pixels": case.make_enhancer(torch.device("cpu")).tile_pixels,
        **figures,
        "seconds_per_megapixel": per_megapixel,
        "ratio": per_megapixel / small["seconds_per_megapixel"],
    }


def _targets(training: list[Row], large: Row) -> dict[str, Row]:
    """Each target with its limit, what was measured, and whether it is met."""
    worst = max(row["outside_share"] for row in training)
    light = [row["of_paper_step"] for row in training if row["recipe"] == LIGHT_RECIPE]
    pairs = {
        "outside_share": (OUTSIDE_LIMIT, worst),
        "large_image_memory_gb": (LARGE_LIMIT_GB, large["peak_memory_gb"]),
        **({"light_step": (LIGHT_LIMIT, light[0])} if light else {}),
    }
    return {
        name: {"limit": limit, "measured": measured, "met": measured <= limit}
        for name, (limit, measured) in pairs.items()
    }
