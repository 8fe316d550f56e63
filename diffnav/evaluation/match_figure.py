"""Two pictures side by side with lines between their matches: right ones green, wrong ones red."""

import cv2
import numpy as np
import torch
from torch import Tensor

from diffnav.images import to_uint8
from diffnav.matching.matches import Matches

GREEN, RED, WHITE, BLACK = (40, 220, 70), (240, 40, 40), (255, 255, 255), (0, 0, 0)
GAP_PX = 8
# cv2 draws at 1/16 pixel.
_SHIFT = 4


def draw_matches(
    image_a: Tensor,
    image_b: Tensor,
    matches: Matches,
    correct_mask: Tensor,
    max_lines: int = 100,
    word: str = "correct",
) -> np.ndarray:
    """The drawing, (max(H_a, H_b), W_a + 8 + W_b, 3) uint8 RGB, labelled "n of m `word`".

    Args:
        image_a, image_b: (3, H, W) in [0, 1]. correct_mask: (M,) bool, from `correct_matches`; where the truth is
            unknown, those that agree on a model, and `word` says so.
        max_lines: of more matches, so many are drawn, spread evenly over their confidences, so that the share of
            red lines is about the share of wrong matches; the label counts all.
    """
    left, right = to_uint8(image_a), to_uint8(image_b)
    offset = left.shape[1] + GAP_PX
    canvas = np.full((max(left.shape[0], right.shape[0]), offset + right.shape[1], 3), 255, np.uint8)
    canvas[: left.shape[0], : left.shape[1]] = left
    canvas[: right.shape[0], offset:] = right
    for index in _drawn(matches, correct_mask, max_lines):
        start, end = matches.points_a[index], matches.points_b[index] + torch.tensor([offset, 0])
        _draw_line(canvas, start.tolist(), end.tolist(), GREEN if correct_mask[index] else RED)
    _write(canvas, f"{int(correct_mask.sum())} of {len(matches)} {word}")
    return canvas


def _drawn(matches: Matches, correct_mask: Tensor, max_lines: int) -> list[int]:
    """Which matches to draw, the rarer colour last, so that it is not covered."""
    ranked = matches.confidence.argsort(descending=True, stable=True)
    count = min(max_lines, len(ranked))
    # The middles of `count` equal parts.
    chosen = ranked[((torch.arange(count) + 0.5) * len(ranked) / max(count, 1)).long()]
    common = bool(correct_mask[chosen].float().mean() >= 0.5)
    return sorted(chosen.tolist(), key=lambda index: bool(correct_mask[index]) != common)


def _draw_line(canvas: np.ndarray, start: list[float], end: list[float], colour: tuple[int, int, int]) -> None:
    a, b = ([round(value * 2**_SHIFT) for value in point] for point in (start, end))
    cv2.line(canvas, a, b, colour, 1, cv2.LINE_AA, _SHIFT)
    for point in (a, b):
        cv2.circle(canvas, point, 2 * 2**_SHIFT, colour, -1, cv2.LINE_AA, _SHIFT)


def _write(canvas: np.ndarray, text: str) -> None:
    """White text on a black plate at the top left, as large as the picture allows."""
    scale = min(0.7, canvas.shape[1] / 700)
    (width, height), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)
    margin = round(10 * scale)
    cv2.rectangle(canvas, (0, 0), (width + 2 * margin, height + below + 2 * margin), BLACK, -1)
    place = (margin, margin + height)
    cv2.putText(canvas, text, place, cv2.FONT_HERSHEY_SIMPLEX, scale, WHITE, 1, cv2.LINE_AA)
