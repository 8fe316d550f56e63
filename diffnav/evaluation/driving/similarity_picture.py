"""How many matches each query has with each reference, as a picture: a bright diagonal where partners win."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.figures import save_figure

_PANEL_INCHES = 3.0
# Of one matcher's methods, before the next line.
_COLUMNS = 6


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
    listed = [list(own.items()) for own in panels.values()]
    lines = [own[start : start + _COLUMNS] for own in listed for start in range(0, len(own), _COLUMNS)]
    columns = max(map(len, lines))
    figure = Figure((_PANEL_INCHES * columns + 0.8, _PANEL_INCHES * len(lines) + 0.2), layout="constrained")
    brightest = {matcher: max(map(_brightest, own.values())) for matcher, own in panels.items()}
    for axes, line in zip(figure.subplots(len(lines), columns, squeeze=False), lines, strict=True):
        for axis in axes[len(line) :]:
            axis.set_visible(False)
        for axis, (method, own) in zip(axes, line, strict=False):
            matcher = own[0].matcher
            scale = {"cmap": "magma", "vmin": 0, "vmax": brightest[matcher]}
            drawn = axis.imshow(similarity_matrix(own), interpolation="nearest", aspect="auto", **scale)
            axis.set_title(f"{method}, {matcher}", fontsize=9)
            axis.set_xlabel("reference", fontsize=8)
            axis.tick_params(labelsize=7)
        figure.colorbar(drawn, ax=list(axes), fraction=0.02, pad=0.01).ax.tick_params(labelsize=7)
        axes[0].set_ylabel("query", fontsize=8)
    save_figure(figure, path)


def _brightest(records: Sequence[DrivingRecord]) -> float:
    return float(np.nanmax(similarity_matrix(records), initial=1.0))
