"""Which pictures the enhancement experiment shows, and its three figures."""

from collections.abc import Sequence
from pathlib import Path

import torch
from torch import Tensor

from diffnav.data.pair_source import PairSource
from diffnav.data.pairs import WholePair
from diffnav.data.photos import Photo
from diffnav.errors import UserError
from diffnav.evaluation.figures import draw_comparison, draw_darkness, draw_decomposition
from diffnav.evaluation.predictions import pair_digest
from diffnav.evaluation.runner import MethodError, Runner
from diffnav.retinex.enhancer import RetinexEnhancer


def write_figures(folder: Path, source: PairSource, runners: Sequence[Runner], photos: Sequence[Photo]) -> list[Path]:
    """Write figure_5_METHOD.png (every Retinex network, the first photo), figure_6.png and figure_9.jpg of `photos`.

    Photos that cannot be read are passed over. Returns the files; none if no photo is left.
    """
    pairs = []
    for photo in photos:
        try:
            pairs.append(source.read(photo))
        except UserError:
            continue  # named by the measurement already
    if not pairs:
        return []
    written = []
    for runner in runners:
        if isinstance(runner.method.enhancer, RetinexEnhancer):
            written.append(folder / f"figure_5_{runner.method.name.replace('/', '_')}.png")
            _decompose(written[-1], runner, pairs[0])
    draw_darkness(folder / "figure_6.png", pairs)
    draw_comparison(folder / "figure_9.jpg", pairs, [_results(runners, pair) for pair in pairs])
    return [*written, folder / "figure_6.png", folder / "figure_9.jpg"]


def choose_photos(photos: Sequence[Photo], count: int, sites: Sequence[str] | None = None) -> list[Photo]:
    """At most `count` photos to show, of as many sites as possible; of `sites` alone where they are given.

    Raises: UserError if there is no photo of these sites.
    """
    groups: dict[str, list[Photo]] = {}
    for photo in photos:
        if sites is None or photo.site in sites:
            groups.setdefault(photo.site, []).append(photo)
    if not groups and photos:
        known = ", ".join(sorted({photo.site for photo in photos})[:20])
        raise UserError(f"figures.sites names no source of these photos; there are {known}")
    chosen: list[Photo] = []
    while len(chosen) < count and any(groups.values()):
        for group in groups.values():
            if group and len(chosen) < count:
                chosen.append(group.pop(0))
    return chosen


def _results(runners: Sequence[Runner], pair: WholePair) -> dict[str, Tensor | None]:
    results: dict[str, Tensor | None] = {}
    digest = pair_digest(pair)
    for runner in runners:
        try:
            results[runner.method.name] = runner.predict(pair, runner.key(digest)).image
        except MethodError:
            results[runner.method.name] = None
    return results


@torch.no_grad()
def _decompose(path: Path, runner: Runner, pair: WholePair) -> None:
    enhancer = runner.method.enhancer
    assert isinstance(enhancer, RetinexEnhancer)
    low, normal = pair["low"], pair["normal"]
    if low.shape[1] * low.shape[2] > enhancer.tile_pixels:
        # R, I and Ih exist tile by tile only: show the middle.
        side = int(enhancer.tile_pixels**0.5)
        top, left = max(0, (low.shape[1] - side) // 2), max(0, (low.shape[2] - side) // 2)
        low, normal = (image[:, top : top + side, left : left + side] for image in (low, normal))
    parts = enhancer.components(low[None].to(runner.method.device))
    draw_decomposition(path, parts, low, normal, f"{runner.method.name}: {pair['name']}")
