"""Enhancing a picture, timed: seconds per megapixel, and one large picture within its memory."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import torch

from diffnav.evaluation.memory import peak_memory_gb
from diffnav.evaluation.timing import PhaseClock, Seconds
from diffnav.retinex.enhancer import RetinexEnhancer
from diffnav.training.allocator import keep_freed_memory

Size = tuple[int, int]


@dataclass(frozen=True)
class InferenceCase:
    """One row: the network (its name and settings), bf16 or float32."""

    network: str
    settings: Mapping[str, Any]
    bf16: bool = False

    @property
    def precision(self) -> str:
        return "bf16" if self.bf16 else "float32"

    @property
    def name(self) -> str:
        return f"{self.network} {self.precision}"

    def make_enhancer(self, device: torch.device) -> RetinexEnhancer:
        """The enhancer with fresh weights, laid out as `load_enhancer` does: speed does not depend on them."""
        enhancer = RetinexEnhancer(**self.settings).eval()
        return enhancer.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]


class InferenceTimer:
    """Enhances one picture of `size` (h, w) at a time; `run` gives the seconds as the phase `forward`."""

    def __init__(self, case: InferenceCase, size: Size, device: torch.device) -> None:
        self.name = case.name
        self._bf16 = case.bf16
        self._device = device
        self._clock = PhaseClock(device)
        self._enhancer = case.make_enhancer(device)
        self._image = torch.rand(1, 3, *size, generator=torch.Generator().manual_seed(0)).to(device)

    @torch.no_grad()
    def run(self) -> Seconds:
        """Enhance the picture once."""
        self._clock.start("forward")
        with torch.autocast(self._device.type, dtype=torch.bfloat16, enabled=self._bf16):
            self._enhancer(self._image)
        return self._clock.stop()


def large_image(case: InferenceCase, size: Size, device: torch.device, threads: int) -> dict[str, float]:
    """`seconds` and `peak_memory_gb` of enhancing one picture (h, w) in tiles; to be called in a process of its own."""
    keep_freed_memory()
    torch.set_num_threads(threads)
    timer = InferenceTimer(case, size, device)
    start = time.perf_counter()
    timer.run()
    return {"seconds": time.perf_counter() - start, "peak_memory_gb": peak_memory_gb(device)}
