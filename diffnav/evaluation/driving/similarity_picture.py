"""How many matches each query has with each reference, as a picture: a bright diagonal where partners win."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.figures import save_figure

_PANEL_INCHES = 3.4


def similarity_matrix(records: Sequence[DrivingRecord]) -> np.ndarray:
    """(queries, references) matches, NaN where they are unknown."""
    width = max((len(record.counts) for record in records), default=0)
    rows = [np.array(record.counts, float) if record.counts else np.full(width, np.nan) for record in records]
    matrix = np.stack(rows)
    return np.where(matrix < 0, np.nan, matrix)


def write_similarity_picture(path: Path, records: Sequence[DrivingRecord]) -> None:
    """Write a panel per method and matcher: queries downwards, references to the right, matches as brightness.

    Where every query failed there is none. The methods of one matcher share a scale.

    Raises: UserError if the file cannot be written.
    """
    answered = {(record.method, record.matcher) for record in records if record.counts}
    panels: dict[str, dict[str, list[DrivingRecord]]] = {}
    for record in records:
        if (record.method, record.matcher) in answered:
            panels.setdefault(record.matcher, {}).setdefault(record.method, []).append(record)
    if not panels:
        return
    columns = max(map(len, panels.values()))
    figure = Figure((_PANEL_INCHES * columns + 0.8, _PANEL_INCHES * len(panels) + 0.2), layout="constrained")
    axes = figure.subplots(len(panels), columns, squeeze=False)
    for line, (matcher, methods) in zip(axes, panels.items(), strict=True):
        matrices = {method: similarity_matrix(own) for method, own in methods.items()}
        brightest = max(np.nanmax(matrix, initial=1.0) for matrix in matrices.values())
        for axis, (method, matrix) in zip(line, matrices.items(), strict=False):
            drawn = axis.imshow(matrix, cmap="magma", vmin=0, vmax=brightest, interpolation="nearest", aspect="auto")
            axis.set_title(f"{method}, {matcher}", fontsize=9)
            axis.tick_params(labelsize=7)
        figure.colorbar(drawn, ax=list(line), fraction=0.02, pad=0.01).ax.tick_params(labelsize=7)
        line[0].set_ylabel("query", fontsize=8)
        for axis in line[len(matrices) :]:
            axis.set_visible(False)
    for axis in axes[-1]:
        axis.set_xlabel("reference", fontsize=8)
    save_figure(figure, path)
