"""Line plots as pictures."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure


def loss_curves(steps: Sequence[int], losses: Mapping[str, Sequence[float]]) -> np.ndarray:
    """The named losses over the steps, one small panel each: (H, W, 3) uint8."""
    columns = min(len(losses), 4)
    rows = -(-len(losses) // columns)
    figure = Figure((2.9 * columns, 2.1 * rows), dpi=110)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True)
    for axis, (name, values) in zip(axes.flat, losses.items(), strict=False):
        axis.plot(steps, values, color="#1f77b4", linewidth=1.3)
        axis.set_title(name, fontsize=9)
        axis.tick_params(labelsize=7)
        axis.grid(alpha=0.25)
    for axis in axes.flat[len(losses) :]:
        axis.set_visible(False)
    for axis in axes[-1]:
        axis.set_xlabel("step", fontsize=8)
    figure.tight_layout()
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
