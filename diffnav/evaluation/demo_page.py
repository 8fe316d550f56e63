"""The demo's page: training, Table 1 and matching on a handful of pictures."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch

from diffnav.evaluation.match_case import MatchCase
from diffnav.evaluation.plots import loss_curves
from diffnav.evaluation.report import Report
from diffnav.images import to_uint8

PICTURES = 3
_NOT_LOSSES = {"step", "learning_rate", "images_per_second"}


def demo_page(
    rows: Sequence[Mapping[str, Any]],
    matched: Sequence[Mapping[str, MatchCase]],
    metrics: Path,
    shown: Sequence[str],
    commands: Sequence[str],
    source: str,
) -> Report:
    """The page.

    Args: rows: of enhancement.json. matched: per picture, method -> its matches. metrics: the training's
    metrics.csv. shown: methods whose pictures and match lines are drawn. commands: what was run. source: what the
    pictures are.
    """
    about = f"{len(matched)} pictures from {source}, darkened by Eq. 9, 8 bit and JPEG."
    page = Report("diffnav: matching in the dark", about)
    page.section("Before and after")
    for results in matched[:PICTURES]:
        strip = [np.rot90(to_uint8(results[name].query), 2) for name in shown]
        page.picture(_side_by_side(strip), " | ".join(shown))
    page.section("Enhancement (Table 1 of the paper) and correct matches")
    page.table(["method", "PSNR dB", "SSIM", "seconds", "correct SIFT matches"], _table(rows, matched))
    page.note(
        "Correct: within 3 px of the true position; the enhanced picture is turned by 180 degrees and matched to the "
        "daylight one (500 SIFT features, ratio .75, mutual). normal is the daylight picture itself, the ceiling."
    )
    page.section("Match lines: dark, enhanced, daylight")
    for results in matched[:PICTURES]:
        for name in shown:
            page.picture(results[name].draw(), name)
    page.section("The training that just ran")
    page.plot(loss_curves(*_losses(metrics)), "Each loss term, weighted as it enters the sum")
    page.section("The same by hand")
    page.code("\n".join(commands))
    return page


def mean_correct(matched: Sequence[Mapping[str, MatchCase]], name: str) -> float:
    """The mean number of correct matches of a method over the pictures."""
    return float(torch.tensor([float(results[name].correct.sum()) for results in matched]).mean())


def _table(rows: Sequence[Mapping[str, Any]], matched: Sequence[Mapping[str, MatchCase]]) -> list[dict[str, str]]:
    table = [
        {
            "method": row["method"],
            "PSNR dB": f"{row['psnr']:.2f}",
            "SSIM": f"{row['ssim']:.3f}",
            "seconds": f"{row['seconds']:.3f}",
            "correct SIFT matches": f"{mean_correct(matched, row['method']):.0f}",
        }
        for row in rows
    ]
    ceiling = {"method": "normal", "PSNR dB": "-", "SSIM": "1.000", "seconds": "-"}
    return [*table, {**ceiling, "correct SIFT matches": f"{mean_correct(matched, 'normal'):.0f}"}]


def _losses(metrics: Path) -> tuple[list[int], dict[str, list[float]]]:
    with metrics.open(newline="") as file:
        rows = list(csv.DictReader(file))
    figures = ("_mean", "_std", "_saturated")
    names = [name for name in rows[0] if name not in _NOT_LOSSES and not name.endswith(figures)]
    return [int(row["step"]) for row in rows], {name: [float(row[name]) for row in rows] for name in names}


def _side_by_side(pictures: Sequence[np.ndarray], gap: int = 6) -> np.ndarray:
    bar = np.full((pictures[0].shape[0], gap, 3), 255, np.uint8)
    return np.concatenate([part for picture in pictures for part in (picture, bar)][:-1], axis=1)
