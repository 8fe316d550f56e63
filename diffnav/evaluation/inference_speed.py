"""Enhancing a picture, timed: by torch, torch.compile or onnxruntime, and one large picture within its memory."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.evaluation.memory import peak_memory_gb
from diffnav.evaluation.timing import PhaseClock, Seconds
from diffnav.export import onnx_model, onnx_session
from diffnav.retinex.enhancer import RetinexEnhancer
from diffnav.training.allocator import keep_freed_memory

Size = tuple[int, int]
# What else than torch's eager mode enhances.
BACKENDS = ("compile", "onnxruntime")


@dataclass(frozen=True)
class InferenceCase:
    """One row: the network (its name and settings), bf16 or float32, what runs it: eager or one of `BACKENDS`."""

    network: str
    settings: Mapping[str, Any]
    bf16: bool = False
    backend: str = "eager"

    @property
    def precision(self) -> str:
        return "bf16" if self.bf16 else "float32"

    @property
    def name(self) -> str:
        name = f"{self.network} {self.precision}"
        return name if self.backend == "eager" else f"{name} {self.backend}"

    def make_enhancer(self, device: torch.device) -> RetinexEnhancer:
        """The enhancer with fresh weights, laid out as `load_enhancer` does: speed does not depend on them."""
        enhancer = RetinexEnhancer(**self.settings).eval()
        return enhancer.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]


class InferenceTimer:
    """Enhances one picture of `size` (h, w) at a time; `run` gives the seconds as the phase `forward`.

    Raises: whatever the case's backend does where it cannot run.
    """

    def __init__(self, case: InferenceCase, size: Size, device: torch.device) -> None:
        self.name = case.name
        self._bf16 = case.bf16
        self._device = device
        self._clock = PhaseClock(device)
        image = torch.rand(1, 3, *size, generator=torch.Generator().manual_seed(0)).to(device)
        self._enhance = _enhancing(case, image)
        if case.backend != "eager":
            # Compiling takes place at the first call, and is not what is timed.
            self.run()

    @torch.no_grad()
    def run(self) -> Seconds:
        """Enhance the picture once."""
        self._clock.start("forward")
        with torch.autocast(self._device.type, dtype=torch.bfloat16, enabled=self._bf16):
            self._enhance()
        return self._clock.stop()


def _enhancing(case: InferenceCase, image: Tensor) -> Callable[[], Any]:
    """What enhances `image` once, by the case's backend."""
    enhancer = case.make_enhancer(image.device)
    if case.backend == "onnxruntime":
        if image.device.type != "cpu":
            raise UserError("onnxruntime is timed on a CPU alone")
        session, picture = onnx_session(onnx_model(enhancer), torch.get_num_threads()), image.numpy()
        return lambda: session.run(["enhanced"], {"image": picture})
    if case.backend == "compile":
        enhancer.compile()
    return lambda: enhancer(image)


def inference_timers(
    networks: Mapping[str, Mapping[str, Any]], backends: Sequence[str], size: Size, device: torch.device
) -> tuple[list[InferenceCase], list[InferenceTimer], list[str]]:
    """The cases, their timers, and a sentence on each case that is left out, for its backend is missing or fails.

    Every network in float32 and bf16 by torch as it is, and in float32 by each of `backends`.
    Raises: UserError if a backend is unknown.
    """
    for backend in backends:
        if backend not in BACKENDS:
            raise UserError(f"backends can be {' and '.join(BACKENDS)}, got {backend!r}")
    cases = [InferenceCase(name, settings, bf16) for name, settings in networks.items() for bf16 in (False, True)]
    timers = [InferenceTimer(case, size, device) for case in cases]
    left_out: list[str] = []
    for name, settings in networks.items():
        for backend in backends:
            case = InferenceCase(name, settings, backend=backend)
            try:
                timers.append(InferenceTimer(case, size, device))
                cases.append(case)
            except Exception as error:  # compilers and runtimes raise types of their own
                reason = (str(error).strip().splitlines() or [type(error).__name__])[0]
                left_out.append(f"{case.name} is left out: {reason}")
    return cases, timers, left_out


def backend_versions(cases: Sequence[InferenceCase]) -> dict[str, str]:
    """Name -> version of what enhances beside torch."""
    used = any(case.backend == "onnxruntime" for case in cases)
    return {"onnxruntime": import_module("onnxruntime").__version__} if used else {}


def inference_rows(cases: Sequence[InferenceCase], medians: Mapping[str, Seconds], size: Size) -> list[dict[str, Any]]:
    """One row per case; `speedup_over_float32` is over the same network in float32 by torch as it is."""
    megapixels = size[0] * size[1] / 1e6
    totals = {case.name: sum(medians[case.name].values()) for case in cases}
    return [
        {
            "name": case.name,
            "network": case.network,
            "precision": case.precision,
            "backend": case.backend,
            "size": list(size),
            "seconds": totals[case.name],
            "seconds_per_megapixel": totals[case.name] / megapixels,
            "ratio": totals[case.name] / totals[cases[0].name],
            "speedup_over_float32": totals[InferenceCase(case.network, case.settings).name] / totals[case.name],
        }
        for case in cases
    ]


def large_image(case: InferenceCase, size: Size, device: torch.device, threads: int) -> dict[str, float]:
    """`seconds` and `peak_memory_gb` of enhancing one picture (h, w) in tiles; to be called in a process of its own."""
    keep_freed_memory()
    torch.set_num_threads(threads)
    timer = InferenceTimer(case, size, device)
    start = time.perf_counter()
    timer.run()
    return {"seconds": time.perf_counter() - start, "peak_memory_gb": peak_memory_gb(device)}
