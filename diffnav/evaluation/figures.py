"""The paper's Figures 5, 6 and 9 as PNG files, drawn from our own pairs and methods."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import torch
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from torch import Tensor
from torch.nn.functional import avg_pool2d

from diffnav.data.pairs import WholePair
from diffnav.errors import UserError
from diffnav.retinex.enhancer import Components
from diffnav.scores import psnr, ssim

_PANEL_INCHES = 2.6
_DPI = 100
_EDGE = "#d62728"


def draw_decomposition(path: Path, parts: Components, low: Tensor, normal: Tensor, title: str) -> None:
    """Figure 5: the dark input, R, I, Ih, Ih o R and daylight. low, normal: (3, H, W); `parts` of that one image."""
    panels: dict[str, Tensor] = {
        "input": low,
        f"reflectance R ({_spread(parts.R)})": parts.R[0],
        f"illumination I ({_spread(parts.I)})": parts.I[0],
        f"enhanced illumination Ih ({_spread(parts.Ih)})": parts.Ih[0],
        f"enhanced = Ih o R ({_scores(parts.enhanced[0], normal)})": parts.enhanced[0],
        "daylight": normal,
    }
    figure, axes = panel_grid(2, 3, low, scale=1.5)
    for axis, (name, picture) in zip((a for row in axes for a in row), panels.items(), strict=True):
        show(axis, picture)
        axis.set_xlabel(name)
    figure.suptitle(title)
    save_figure(figure, path)


def draw_darkness(path: Path, pairs: Sequence[WholePair]) -> None:
    """Figure 6: synthetic dark samples under their daylight pictures, with the gamma of each."""
    figure, axes = panel_grid(2, len(pairs), pairs[0]["normal"])
    for column, pair in enumerate(pairs):
        record = pair["record"]
        show(axes[0][column], pair["normal"])
        show(axes[1][column], pair["low"])
        axes[0][column].set_title(pair["name"])
        axes[1][column].set_xlabel(f"gamma {record.gamma:.2f}" if record else "real darkness")
    axes[0][0].set_ylabel("daylight")
    axes[1][0].set_ylabel("dark")
    save_figure(figure, path)


def draw_comparison(path: Path, pairs: Sequence[WholePair], pictures: Sequence[Mapping[str, Tensor | None]]) -> None:
    """Figure 9: one line per method and daylight last; each pair whole and, framed, its busiest part enlarged.

    `pictures` holds per pair the result (3, H, W) of every method, None where it failed.
    """
    names = [*pictures[0], "daylight"]
    figure, axes = panel_grid(len(names), 2 * len(pairs), pairs[0]["normal"])
    for column, (pair, results) in enumerate(zip(pairs, pictures, strict=True)):
        window = busiest_window(pair["normal"])
        shown = {**results, "daylight": pair["normal"]}
        for line, name in enumerate(names):
            whole, part = axes[line][2 * column : 2 * column + 2]
            _show_both(whole, part, shown[name], window)
            picture = shown[name]
            if name != "daylight":
                whole.set_xlabel("failed" if picture is None else _scores(picture, pair["normal"]))
        axes[0][2 * column].set_title(pair["name"])
        axes[0][2 * column + 1].set_title("the framed part")
    for line, name in enumerate(names):
        axes[line][0].set_ylabel(name)
    save_figure(figure, path)


def busiest_window(image: Tensor, share: int = 4) -> tuple[int, int, int, int]:
    """(top, left, height, width) of the window, 1 / share of the sides, with the largest mean gradient of (3, H, W)."""
    height, width = (max(1, side // share) for side in image.shape[1:])
    grey = image.float().mean(0)
    gradient = torch.zeros_like(grey)
    gradient[:-1, :-1] = (grey[1:, :-1] - grey[:-1, :-1]).abs() + (grey[:-1, 1:] - grey[:-1, :-1]).abs()
    step = max(1, min(height, width) // 4)
    means = avg_pool2d(gradient[None, None], (height, width), stride=step)[0, 0]
    row, column = divmod(int(means.argmax()), means.shape[1])
    return row * step, column * step, height, width


def _show_both(whole: Axes, part: Axes, picture: Tensor | None, window: tuple[int, int, int, int]) -> None:
    if picture is None:
        for axis in (whole, part):
            axis.set_facecolor("0.9")
        return
    top, left, height, width = window
    show(whole, picture)
    whole.add_patch(Rectangle((left, top), width, height, fill=False, edgecolor=_EDGE, clip_on=False))
    show(part, picture[:, top : top + height, left : left + width])


def panel_grid(rows: int, columns: int, like: Tensor, scale: float = 1.0) -> tuple[Figure, Any]:
    """A figure of equal panels in the shape of an image (3, H, W), without ticks."""
    wide = _PANEL_INCHES * scale
    figure = Figure((columns * wide, rows * (wide * like.shape[1] / like.shape[2] + 0.3)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis in axes.flat:
        axis.set_xticks([])
        axis.set_yticks([])
    return figure, axes


def show(axis: Axes, picture: Tensor) -> None:
    """Draw (3, H, W) in colour or (1, H, W) in grey, black at 0 and white at 1."""
    values = picture.detach().float().clamp(0, 1).permute(1, 2, 0).cpu().numpy()
    axis.imshow(values[..., 0] if values.shape[2] == 1 else values, cmap="gray", vmin=0, vmax=1)


def _scores(picture: Tensor, normal: Tensor) -> str:
    both = picture[None].cpu(), normal[None]
    return f"{psnr(*both).item():.2f} dB, {ssim(*both).item():.3f}"


def _spread(values: Tensor) -> str:
    return f"{values.mean().item():.2f} ± {values.std(unbiased=False).item():.2f}"


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure in the format that its ending names. Raises: UserError if the folder cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=_DPI)
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error.strerror}); choose another out=") from None
