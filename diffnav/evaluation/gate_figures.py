"""The paper's Figure 7, definition under several lights, and the ROC of telling dark pictures by it, as PNG files."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from torch import Tensor

from diffnav.errors import UserError
from diffnav.evaluation.figures import save_figure, show
from diffnav.navigation.gates.definition import definition, laplacian
from diffnav.navigation.gates.threshold import Roc

_PANEL_INCHES = 2.6
_BLUE, _RED = "#1f77b4", "#d62728"
# The axis is logarithmic: pictures of less definition, a constant one's is 0, are drawn here.
_LEAST = 0.05
# Of the Laplacians shown, the quantile that is drawn white.
_WHITE = 0.99


def write_figure_7(
    path: Path, pictures_by_light: Mapping[str, Sequence[Tensor]], threshold: float | None = None
) -> None:
    """Figure 7: of each light its first picture and |Laplacian|, all on one scale; below, all pictures' definitions.

    Args: pictures_by_light: pictures (3, H, W) in [0, 1], one or more, by what the light is called, dark to bright.
        threshold: of the definition gate, drawn as a line.
    Raises: UserError if a light has no picture, or the file cannot be written.
    """
    empty = [light for light, pictures in pictures_by_light.items() if not len(pictures)]
    if empty or not pictures_by_light:
        raise UserError(f"no picture of the light {empty[0]}" if empty else "no light to draw Figure 7 of; give some")
    values = {
        light: [definition(picture).item() for picture in pictures] for light, pictures in pictures_by_light.items()
    }
    count = len(pictures_by_light)
    first = next(iter(pictures_by_light.values()))[0]
    panel = _PANEL_INCHES * first.shape[1] / first.shape[2] + 0.35
    below = 0.3 * count + 0.9
    figure = Figure((_PANEL_INCHES * count, 2 * panel + below), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(3, count, height_ratios=[panel, panel, below])
    edges = {light: laplacian(pictures[0]).abs() for light, pictures in pictures_by_light.items()}
    white = max(float(np.quantile(edge.numpy(), _WHITE)) for edge in edges.values()) or 1.0
    for column, (light, pictures) in enumerate(pictures_by_light.items()):
        above, edge = (_bare(figure.add_subplot(grid[row, column])) for row in (0, 1))
        show(above, pictures[0])
        above.set_title(light, fontsize=10)
        show(edge, edges[light][None] / white)
        edge.set_xlabel(f"Df = {values[light][0]:.2f}")
    _draw_values(figure.add_subplot(grid[2, :]), values, threshold)
    save_figure(figure, path)


def write_roc(path: Path, curves: Mapping[str, Roc], chosen: Mapping[str, tuple[float, float]] | None = None) -> None:
    """Shares of dark and of normal pictures enhanced at every threshold, one curve a name.

    chosen: by name the (normal_enhanced, dark_enhanced) of the threshold in use, drawn as a dot.
    Raises: UserError if the file cannot be written.
    """
    figure = Figure((4.6, 4.4), layout="constrained")
    FigureCanvasAgg(figure)
    axis = figure.add_subplot()
    axis.plot([0, 1], [0, 1], color="0.8", linewidth=1)
    for name, curve in curves.items():
        (line,) = axis.plot(
            curve.normal_enhanced, curve.dark_enhanced, label=f"{name}: AUC {curve.auc:.3f}", linewidth=1.6
        )
        if chosen and name in chosen:
            axis.plot(*chosen[name], "o", color=line.get_color())
    axis.set_xlabel("normal pictures enhanced")
    axis.set_ylabel("dark pictures enhanced")
    axis.set_aspect("equal")
    axis.grid(alpha=0.25)
    axis.legend(loc="lower right", fontsize=9)
    save_figure(figure, path)


def _bare(axis: Axes) -> Axes:
    axis.set_xticks([])
    axis.set_yticks([])
    return axis


def _draw_values(axis: Axes, values: Mapping[str, Sequence[float]], threshold: float | None) -> None:
    """One line of dots a light, its median as a stroke."""
    for row, own in enumerate(values.values()):
        shown = np.maximum(own, _LEAST)
        axis.plot(shown, np.full(len(shown), row), "o", color=_BLUE, markersize=4, alpha=0.5, markeredgewidth=0)
        axis.plot([np.median(shown)] * 2, [row - 0.35, row + 0.35], color=_BLUE, linewidth=2)
    if threshold is not None:
        axis.axvline(threshold, color=_RED, linewidth=1.2)
        axis.set_title(f"definition Df; red: the gate's threshold, {threshold:.2f}", fontsize=10)
    else:
        axis.set_title("definition Df", fontsize=10)
    axis.set_xscale("log")
    axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.set_yticks(range(len(values)), list(values))
    axis.set_ylim(len(values) - 0.5, -0.5)
    axis.grid(axis="x", alpha=0.25)
