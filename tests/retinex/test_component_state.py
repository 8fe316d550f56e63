"""The figures that show whether the Retinex is alive."""

import pytest
import torch

from diffnav.retinex.enhancer import Components
from diffnav.retinex.state import component_state, illumination_is_alive


def parts_with(Ih: torch.Tensor) -> Components:
    R = torch.full((1, 3, 2, 2), 0.5)
    I = torch.tensor([0.0, 0.005, 0.995, 0.5]).reshape(1, 1, 2, 2)
    return Components(R, I, Ih, Ih * R)


def test_figures_by_hand():
    state = component_state(parts_with(torch.tensor([0.2, 0.4, 0.6, 0.8]).reshape(1, 1, 2, 2)))
    assert state.keys() == {f"{part}_{figure}" for part in ("R", "I", "Ih") for figure in ("mean", "std", "saturated")}
    assert (state["R_mean"].item(), state["R_std"].item(), state["R_saturated"].item()) == (0.5, 0, 0)
    assert state["I_mean"].item() == pytest.approx(0.375)
    assert state["I_saturated"].item() == pytest.approx(0.75)
    assert state["Ih_std"].item() == pytest.approx(0.05**0.5)


def test_a_constant_or_saturated_illumination_is_dead():
    size = (1, 1, 2, 2)
    varied = torch.tensor([0.2, 0.4, 0.6, 0.8]).reshape(size)
    nearly_all_one = torch.tensor([1.0, 1.0, 1.0, 0.5]).reshape(size)
    verdicts = {"varied": varied, "constant": torch.full(size, 0.7), "saturated": nearly_all_one}
    alive = {
        name: illumination_is_alive({key: value.item() for key, value in component_state(parts_with(Ih)).items()})
        for name, Ih in verdicts.items()
    }
    assert alive == {"varied": True, "constant": False, "saturated": False}
