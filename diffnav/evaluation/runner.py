"""One method on one pair: from the cache, or run, timed and watched."""

import time

import torch
from torch import Tensor, nn

from diffnav.data.pairs import WholePair
from diffnav.errors import UserError
from diffnav.evaluation.methods import Method
from diffnav.evaluation.predictions import Prediction, PredictionCache, prediction_key
from diffnav.evaluation.provenance import device_name
from diffnav.images import quantise
from diffnav.retinex.enhancer import Components, RetinexEnhancer
from diffnav.retinex.state import component_state

_FAILURES = (UserError, ValueError, RuntimeError, MemoryError)


class MethodError(Exception):
    """A method could not enhance one picture, and why; the others go on."""


class Runner:
    """Runs one method on pairs; its first picture is run twice, for the timing starts after a warm-up (D22)."""

    def __init__(self, method: Method, cache: PredictionCache) -> None:
        self.method = method
        self.cache = cache
        self._warm = False

    def key(self, digest: str) -> str:
        """The key of this method's prediction for the pair with this digest."""
        return prediction_key(self.method.fingerprint, digest)

    @torch.no_grad()
    def predict(self, pair: WholePair, key: str) -> Prediction:
        """The enhanced picture of a pair, from the cache if it is there. Raises: MethodError."""
        prediction = self.cache.get(key)
        if prediction is None:
            try:
                prediction = self._enhance(pair)
            except _FAILURES as error:
                raise MethodError(" ".join(str(error).split()) or type(error).__name__) from error
            self.cache.put(key, prediction)
        return prediction

    def _enhance(self, pair: WholePair) -> Prediction:
        low = pair["low"][None].to(self.method.device)
        if not self._warm:
            self._run(low, pair)
            self._warm = True
        watch = ComponentWatch(self.method.enhancer)
        with watch:
            image, seconds = self._run(low, pair)
        if image.shape != low.shape or not torch.isfinite(image).all():
            raise ValueError("the result holds NaN or infinite values, or is of another size")
        return Prediction(quantise(image[0].float().cpu()), seconds, watch.means(), device_name(self.method.device))

    def _run(self, low: Tensor, pair: WholePair) -> tuple[Tensor, float]:
        records = [pair["record"]] if pair["record"] else None
        _synchronise(low.device)
        start = time.perf_counter()
        image = self.method.enhancer(low, records)
        _synchronise(low.device)
        return image, time.perf_counter() - start


class ComponentWatch:
    """While entered, notes the state of R, I and Ih at every call of a Retinex enhancer's Enhance-Net.

    So the figures are those of the very forward pass that made the picture; tiles count alike.
    """

    def __init__(self, enhancer: nn.Module) -> None:
        self.enhancer = enhancer
        self._states: list[dict[str, Tensor]] = []

    def __enter__(self) -> None:
        if isinstance(self.enhancer, RetinexEnhancer):
            self._handle = self.enhancer.enhance.register_forward_hook(self._note)

    def __exit__(self, *_: object) -> None:
        if isinstance(self.enhancer, RetinexEnhancer):
            self._handle.remove()

    def _note(self, _: nn.Module, inputs: tuple[Tensor, Tensor], output: Tensor) -> None:
        R, I = inputs
        # What follows Ih is a residual, where the network has one.
        self._states.append(component_state(Components(R, I, output[:, :1], R)))

    def means(self) -> dict[str, float]:
        """Each figure's mean over the calls; empty where there are no such components."""
        if not self._states:
            return {}
        return {name: torch.stack([s[name] for s in self._states]).mean().item() for name in self._states[0]}


def _synchronise(device: torch.device) -> None:
    if device.type == "cuda":
        torch.cuda.synchronize(device)
