"""The paper's Figure 11 for our own drives: queries with the references that won, and the matches between them."""

from collections.abc import Sequence
from pathlib import Path

import torch

from diffnav.data.driving.driving_set import Frame, frames_apart
from diffnav.evaluation.driving.drive_test import DriveTest
from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.driving.rows import HIGH, LOW
from diffnav.evaluation.figures import panel_grid, save_figure, show
from diffnav.evaluation.match_figure import draw_matches
from diffnav.images import from_uint8, resize

# Of one picture in a panel, pixels: two stand side by side.
_WIDTH_PX = 480
_PANEL_SCALE = 2.4


@torch.no_grad()
def write_figure_11(path: Path, records: Sequence[DrivingRecord], test: DriveTest, count: int) -> None:
    """Write the figure for at most `count` queries: first those on which the methods disagree, then wrong, then right.

    One line per query, one column per method: dark, enhanced, daylight; the picture as it was matched, the reference
    that won, and their matches: green where they agree on a fundamental matrix. Of the first matcher. Nothing is
    written where nothing was answered.
    """
    shown = _shown_methods(test)
    matcher = test.matchers[0].name
    by_query: dict[str, dict[str, DrivingRecord]] = {}
    for record in records:
        if record.matcher == matcher and record.method in shown and record.answer("matches") is not None:
            by_query.setdefault(record.name, {})[record.method] = record
    chosen = choose_queries([own for own in by_query.values() if len(own) == len(shown)], count)
    if not chosen:
        return
    numbers = {frame.name: k for k, frame in enumerate(test.drive.queries)}
    height, width = test.references[0].size
    panel = torch.empty(3, round(height * _WIDTH_PX / width), 2 * _WIDTH_PX)
    figure, axes = panel_grid(len(chosen), len(shown), panel, _PANEL_SCALE)
    for line, own in zip(axes, chosen, strict=True):
        for axis, method in zip(line, shown, strict=True):
            record = own[method]
            answer = record.answer("matches")
            assert answer is not None
            drive = test.drive
            _, image, matches = test.matches(numbers[record.name], method, matcher, answer)
            reference = drive.references[answer].read(test.longest_side)
            drawing = draw_matches(image, reference, matches, test.verify(matches).inliers, word="agree")
            tall = round(drawing.shape[0] * panel.shape[2] / drawing.shape[1])
            show(axis, resize(from_uint8(drawing), (tall, panel.shape[2])))
            axis.set_xlabel(f"{method}: {outcome(drive.references[answer], drive.references[record.truth])}")
        line[0].set_ylabel(next(iter(own.values())).name.rsplit("/", 1)[-1])
    save_figure(figure, path)


def choose_queries(answered: Sequence[dict[str, DrivingRecord]], count: int) -> list[dict[str, DrivingRecord]]:
    """Records of at most `count` queries, method -> record, spread evenly over each kind of outcome.

    First those on which the methods disagree, then those that all got wrong, then those that all got right.
    """
    kinds: dict[str, list[dict[str, DrivingRecord]]] = {"mixed": [], "wrong": [], "right": []}
    for own in answered:
        right = {record.answer("matches") == record.truth for record in own.values()}
        kinds["mixed" if len(right) > 1 else "right" if True in right else "wrong"].append(own)
    chosen: list[dict[str, DrivingRecord]] = []
    for k, kind in enumerate(kinds.values()):
        # Each of the kinds that are left has its part of what is left.
        most = -(-(count - len(chosen)) // (len(kinds) - k))
        step = max(1, len(kind) // max(most, 1))
        chosen += kind[::step][:most]
    return chosen


def outcome(answer: Frame, partner: Frame) -> str:
    """In words, where an answer lies."""
    apart = frames_apart(answer, partner)
    if apart == 0:
        return "right"
    return "another record" if apart == float("inf") else f"{apart:.0f} {'moment' if apart == 1 else 'moments'} off"


def _shown_methods(test: DriveTest) -> list[str]:
    """The dark picture, the last method that is neither end, and daylight."""
    names = [method.name for method in test.methods]
    middle = [name for name in names if name not in (LOW, HIGH)][-1:]
    return [name for name in (LOW, *middle, HIGH) if name in names]
