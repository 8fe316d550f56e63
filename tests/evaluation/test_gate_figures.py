"""Figure 7 and the ROC: what is drawn where, on pictures made by hand."""

import numpy as np
import pytest
import torch
from matplotlib.figure import Figure
from PIL import Image

from diffnav.errors import UserError
from diffnav.evaluation import gate_figures
from diffnav.evaluation.gate_figures import write_figure_7, write_roc
from diffnav.navigation.gates.threshold import roc

NOISE = torch.rand(3, 40, 60, generator=torch.Generator().manual_seed(0))


@pytest.fixture
def drawn(monkeypatch) -> list[Figure]:
    """The figures that would be written."""
    figures: list[Figure] = []
    monkeypatch.setattr(gate_figures, "save_figure", lambda figure, _path: figures.append(figure))
    return figures


def test_each_light_shows_its_first_picture_its_laplacian_and_all_values(drawn, tmp_path):
    lights = {"dark": [0.1 * NOISE, torch.zeros(3, 40, 60), 0.2 * NOISE], "day": [NOISE]}
    write_figure_7(tmp_path / "f.png", lights, threshold=30.0)
    *panels, values = drawn[0].axes
    assert [panel.get_title() for panel in panels] == ["dark", "", "day", ""]
    shown = [panel.get_images()[0].get_array() for panel in panels]
    assert np.allclose(shown[0], 0.1 * NOISE.permute(1, 2, 0), atol=1e-6)
    assert np.allclose(shown[2], NOISE.permute(1, 2, 0), atol=1e-6)
    # On one scale: a tenth of the light has a tenth of the Laplacian.
    inside = np.asarray(shown[3]) < 1
    assert np.allclose(shown[1][inside], 0.1 * np.asarray(shown[3])[inside], atol=1e-6)
    dots = [line.get_xdata() for line in values.lines if line.get_marker() == "o"]
    assert [len(own) for own in dots] == [3, 1]
    assert dots[0][0] == pytest.approx(0.1 * dots[1][0], rel=1e-4)
    assert dots[0][2] == pytest.approx(0.2 * dots[1][0], rel=1e-4)
    assert [tick.get_text() for tick in values.get_yticklabels()] == ["dark", "day"]
    assert panels[3].get_xlabel() == f"Df = {dots[1][0]:.2f}"
    assert "30.00" in values.get_title()


def test_they_are_written_as_pictures(tmp_path):
    write_figure_7(tmp_path / "new" / "figure_7.png", {"constant": [torch.full((3, 20, 30), 0.5)]})
    write_roc(tmp_path / "roc.png", {"definition": roc([3.0, 4.0], [1.0, 2.0])}, {"definition": (0.0, 1.0)})
    for name in ("new/figure_7.png", "roc.png"):
        levels = np.asarray(Image.open(tmp_path / name).convert("RGB"))
        assert levels.std() > 1
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"f\.png: cannot be written"):
        write_figure_7(tmp_path / "file" / "f.png", {"day": [NOISE]})


def test_curves_carry_their_area_and_the_chosen_point(drawn, tmp_path):
    curve = roc([2.0, 4.0], [1.0, 2.0])
    write_roc(tmp_path / "r.png", {"gamma 4": curve}, {"gamma 4": (0.5, 1.0)})
    (axis,) = drawn[0].axes
    _, line, dot = axis.lines
    assert line.get_xdata().tolist() == [0, 0, 0.5, 1]
    assert line.get_ydata().tolist() == [0, 0.5, 1, 1]
    # Three and a half of four pairs are in order.
    assert line.get_label() == "gamma 4: AUC 0.875"
    assert (list(dot.get_xdata()), list(dot.get_ydata())) == ([0.5], [1.0])


def test_lights_without_pictures_are_named(tmp_path):
    with pytest.raises(UserError, match="no picture of the light dusk"):
        write_figure_7(tmp_path / "f.png", {"day": [NOISE], "dusk": []})
    with pytest.raises(UserError, match="no light"):
        write_figure_7(tmp_path / "f.png", {})
