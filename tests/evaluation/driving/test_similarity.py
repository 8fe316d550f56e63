"""The picture of all matches: the matrix behind it, and that partners are seen as a bright diagonal."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from driving_stubs import answer
from PIL import Image

from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.driving.similarity_picture import similarity_matrix, write_similarity_picture


def test_the_matrix_by_hand() -> None:
    records = [
        answer(0, counts=[7, 1, 0, -1, 2]),
        answer(1, method="net", failure="why"),
        answer(2, counts=[-1, -1, 9, -1, -1]),
    ]
    matrix = similarity_matrix(records)
    nan = np.nan
    expected = [[7, 1, 0, nan, 2], [nan] * 5, [nan, nan, 9, nan, nan]]
    assert np.array_equal(matrix, expected, equal_nan=True)


def picture(path: Path) -> np.ndarray:
    with Image.open(path) as drawn:
        return np.asarray(drawn.convert("RGB"), dtype=int)


def perfect(method: str = "net", count: int = 100, matcher: str = "orb_gms") -> list[DrivingRecord]:
    return [answer(k, k, method, count, matcher) for k in range(5)]


def bright(drawing: np.ndarray) -> np.ndarray:
    """The colour that the scale begins with is near black, the one that it ends with a pale yellow."""
    return (drawing[..., 0] > 240) & (drawing[..., 1] > 240) & (drawing[..., 2] > 150) & (drawing[..., 2] < 215)


def test_partners_are_a_bright_diagonal(tmp_path: Path) -> None:
    write_similarity_picture(tmp_path / "one.png", perfect())
    rows, columns = np.nonzero(bright(picture(tmp_path / "one.png")))
    # Not the scale at the right edge.
    panel = columns < 0.8 * columns.max()
    assert panel.sum() > 1000
    assert np.corrcoef(rows[panel], columns[panel])[0, 1] > 0.9


def test_a_panel_per_method_and_matcher_on_one_scale(tmp_path: Path) -> None:
    records = perfect("input", 10) + perfect("net") + perfect("net", matcher="sift")
    write_similarity_picture(tmp_path / "four.png", records)
    write_similarity_picture(tmp_path / "one.png", perfect())
    four, one = picture(tmp_path / "four.png"), picture(tmp_path / "one.png")
    assert four.shape[0] > 1.7 * one.shape[0]
    assert four.shape[1] > 1.6 * one.shape[1]
    # A tenth of the other's matches is dark beside it.
    upper = bright(four)[: len(four) // 2]
    assert upper[:, : four.shape[1] // 2 - 20].sum() == 0
    assert upper[:, four.shape[1] // 2 :].sum() > 1000


def test_failures_and_shortlists_leave_gaps(tmp_path: Path) -> None:
    left_out = [answer(k, counts=[-1] * k + [9] + [-1] * (4 - k)) for k in range(4)]
    write_similarity_picture(tmp_path / "gaps.png", [*left_out, answer(4, failure="why")])
    assert picture(tmp_path / "gaps.png").shape[0] > 100


def test_who_failed_on_everything_has_no_panel(tmp_path: Path) -> None:
    failed = [replace(record, counts=[], failure="why", method="weak") for record in perfect()]
    other = [replace(record, matcher="sift") for record in failed]
    write_similarity_picture(tmp_path / "one.png", perfect())
    write_similarity_picture(tmp_path / "three.png", failed + perfect() + other)
    assert np.array_equal(picture(tmp_path / "one.png"), picture(tmp_path / "three.png"))


def test_without_matches_nothing_is_written(tmp_path: Path) -> None:
    for records in ([], [answer(0, failure="why")]):
        write_similarity_picture(tmp_path / "none.png", records)
    assert list(tmp_path.iterdir()) == []
