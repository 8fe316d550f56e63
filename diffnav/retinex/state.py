"""The state of R, I and Ih: is the Retinex alive, or has an illumination collapsed to a constant?"""

import torch
from torch import Tensor

from diffnav.retinex.enhancer import Components

# Closer than this to 0 or 1 a value counts as saturated: its sigmoid passes under 1 % of the gradient.
SATURATION = 0.01
# An illumination that varies less than this (standard deviation over an image set) is no longer used.
ALIVE_STD = 0.02


@torch.no_grad()
def component_state(parts: Components) -> dict[str, Tensor]:
    """Mean, standard deviation and saturated share of R, I and Ih, scalars: `R_mean`, `R_std`, `R_saturated`, ..."""
    figures: dict[str, Tensor] = {}
    for name in ("R", "I", "Ih"):
        values: Tensor = getattr(parts, name).float()
        saturated = (values < SATURATION) | (values > 1 - SATURATION)
        figures[f"{name}_mean"] = values.mean()
        figures[f"{name}_std"] = values.std(unbiased=False)
        figures[f"{name}_saturated"] = saturated.float().mean()
    return figures


def illumination_is_alive(state: dict[str, float]) -> bool:
    """Whether Ih still varies and is not saturated, from `component_state`'s figures."""
    return state["Ih_std"] >= ALIVE_STD and state["Ih_saturated"] < 0.5
