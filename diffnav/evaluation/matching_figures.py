"""The paper's Figure 1 for our own pairs: match lines of the best, the median and the worst pair."""

from collections.abc import Sequence
from pathlib import Path

import torch

from diffnav.data.match_pairs.match_pair import MatchPairs
from diffnav.data.photos import Photo
from diffnav.evaluation.contest import NamedMatcher
from diffnav.evaluation.figures import panel_grid, save_figure, show
from diffnav.evaluation.match_case import match_case
from diffnav.evaluation.match_records import MatchRecord
from diffnav.evaluation.predictions import pair_digest
from diffnav.evaluation.runner import MethodError, Runner
from diffnav.images import from_uint8

# Of the pictures' sides: two of 600 x 400 then make a panel of 608 x 200.
SHRINK = 0.5
PANEL_SCALE = 2.4


def write_match_figures(
    folder: Path,
    source: MatchPairs,
    runners: Sequence[Runner],
    matchers: Sequence[NamedMatcher],
    records: Sequence[MatchRecord],
    photos: Sequence[Photo],
) -> list[Path]:
    """Write figure_1_MATCHER.jpg for every matcher: three pairs, one column per method.

    The pairs are those, of `photos` alone, with most, median and fewest correct matches of the last method. Returns
    the files; none for a matcher without records of these photos, or without runners.
    """
    by_name = {photo.name: photo for photo in photos}
    written = []
    for named in matchers if runners else []:
        last = runners[-1].method.name
        own = [r for r in records if (r.method, r.matcher) == (last, named.name) and r.name in by_name]
        if own:
            path = folder / f"figure_1_{named.name.replace('/', '_')}.jpg"
            chosen = {label: by_name[record.name] for label, record in best_median_worst(own).items()}
            _draw(path, source, runners, named, chosen)
            written.append(path)
    return written


def best_median_worst(records: Sequence[MatchRecord]) -> dict[str, MatchRecord]:
    """Label -> the record with most, median (the upper of two) and fewest correct matches; ties by name."""
    ranked = sorted(records, key=lambda r: (-r.correct, r.name))
    return {"best": ranked[0], "median": ranked[(len(ranked) - 1) // 2], "worst": ranked[-1]}


@torch.no_grad()
def _draw(
    path: Path, source: MatchPairs, runners: Sequence[Runner], named: NamedMatcher, photos: dict[str, Photo]
) -> None:
    pairs = {label: source.read(photo) for label, photo in photos.items()}
    height, width = (max(pair.reference.shape[side] for pair in pairs.values()) for side in (1, 2))
    figure, axes = panel_grid(len(pairs), len(runners), torch.empty(3, height, 2 * width), PANEL_SCALE)
    for line, (label, pair) in enumerate(pairs.items()):
        reference = named.matcher.features(pair.reference)
        for column, runner in enumerate(runners):
            axis = axes[line][column]
            try:
                enhanced = runner.predict(pair.pair, runner.key(pair_digest(pair.pair))).image
            except MethodError:
                axis.set_facecolor("0.9")
                continue
            case = match_case(pair, enhanced, named.matcher, reference)
            show(axis, from_uint8(case.draw(shrink=SHRINK)))
        axes[line][0].set_ylabel(f"{label}: {photos[label].name}")
    for column, runner in enumerate(runners):
        axes[0][column].set_title(f"{runner.method.name}, {named.name}")
    save_figure(figure, path)
