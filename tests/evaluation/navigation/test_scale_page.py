"""The scale study's rows, targets, page and plot, from records made by hand."""

import json
from pathlib import Path

import pytest
from PIL import Image

from diffnav.evaluation.navigation.scale import ScaleRecord
from diffnav.evaluation.navigation.scale_page import growth, scale_page, scale_rows, scale_targets, write_scale_plot


def record(tiles: int, mode: str, **facts: object) -> ScaleRecord:
    plain: dict = {
        "key": f"{tiles} {mode}",
        "tiles": tiles,
        "mode": mode,
        "open_seconds": 2.0,
        "idle_gb": 0.3,
        "peak_gb": 0.5,
        "index_bytes": None if mode == "exhaustive" else 27_000 * tiles,
        "feature_bytes": 42_000 * tiles,
    }
    if mode != "index":
        plain |= {"seconds": [0.1] * 4, "errors_m": [1.0] * 4, "milliseconds": {"match": 80.0}}
    if mode == "shortlist":
        plain["ranks"] = [1, 1, 2, 1]
    return ScaleRecord(**(plain | facts))


def study(last: float = 1.0) -> list[ScaleRecord]:
    """Seconds of the shortlist as the root of the tiles, exhaustive as the tiles."""
    return [
        record(9, "index", open_seconds=0.5),
        record(9, "shortlist", seconds=[1.0, 1.0, 1.0, 9.0]),
        record(9, "exhaustive"),
        record(100, "index", open_seconds=5.0, peak_gb=0.7),
        record(100, "shortlist", seconds=[0.1] * 4),
        record(100, "exhaustive", seconds=[0.5] * 4, errors_m=[1.0, None, 10.0, 10.1]),
        record(10_000, "shortlist", seconds=[last] * 4),
    ]


def test_rows_are_per_tiles_and_mode() -> None:
    rows = scale_rows(study())
    assert [(row["tiles"], row["mode"]) for row in rows] == [
        (9, "shortlist"), (9, "exhaustive"), (100, "shortlist"), (100, "exhaustive"), (10_000, "shortlist"),
    ]  # fmt: skip
    first, short, every = rows[0], rows[2], rows[3]
    # Between the third and the fourth of four, seven tenths of the way.
    assert (first["seconds"], first["p90_seconds"], first["build_seconds"]) == (1.0, pytest.approx(6.6), 0.5)
    assert (short["index_gb"], short["features_gb"], short["peak_gb"]) == (0.0027, 0.0042, 0.5)
    assert (short["build_seconds"], short["build_gb"], short["open_seconds"]) == (5.0, 0.7, 2.0)
    assert (short["rank_1"], short["rank_5"], short["rank_10"]) == (0.75, 1.0, 1.0)
    assert short["milliseconds"] == {"match": 80.0}
    # No fix and one just beyond ten metres are misses.
    assert every["recall_10m"] == 0.5
    assert every["rank_1"] is every["index_gb"] is every["build_seconds"] is None
    assert rows[4]["build_seconds"] is None
    assert json.loads(json.dumps(rows, allow_nan=False)) == rows


def test_growth_is_the_power_of_the_number_of_tiles() -> None:
    rows = scale_rows(study())
    # From 100 on: with the 9 tiles, where constants count, it would be another.
    assert growth(rows, "shortlist") == pytest.approx(0.5)
    assert growth(rows, "exhaustive") is None


def test_targets_are_judged() -> None:
    found = scale_targets(scale_rows(study()))
    assert found == {
        "seconds": {"limit": 1.5, "measured": 1.0, "met": True},
        "exponent": {"limit": 1.0, "measured": pytest.approx(0.5), "met": True},
        # At 100 tiles the shortlist finds more than exhaustive search, at 9 as much: no loss.
        "recall_loss": {"limit": 0.02, "measured": 0.0, "met": True},
    }
    worse = scale_rows([*study(last=20.0), record(50, "exhaustive"),
                        record(50, "shortlist", errors_m=[1.0, 1.0, 1.0, None])])  # fmt: skip
    found = scale_targets(worse)
    assert [(one["measured"], one["met"]) for one in found.values()] == [
        (20.0, False), (pytest.approx(1.15, abs=0.01), False), (0.25, False),
    ]  # fmt: skip
    assert list(scale_targets(scale_rows([record(9, "shortlist")]))) == ["seconds"]


def test_the_page_shows_all(tmp_path: Path) -> None:
    rows = scale_rows(study())
    page = scale_page(rows, scale_targets(rows), {"seed": 3})
    lines = {tuple(c.strip() for c in line.split("|")[1:3]): line for line in page.splitlines() if line[:2] == "| "}
    cells = [cell.strip() for cell in lines["10,000", "shortlist"].split("|")[1:-1]]
    assert cells[2:9] == ["4", "1", "1", "1.000", "0.750", "1.000", "1.000"]
    assert cells[9:] == ["0.27", "0.42", "0.5", "0.3", "2", "-", "-"]
    assert lines["100", "exhaustive"].count(" - ") == 6
    assert "| exponent    |     1 |      0.5 | yes |" in page
    assert "- seed: `3`" in page
    write_scale_plot(tmp_path / "scale.png", rows)
    with Image.open(tmp_path / "scale.png") as picture:
        assert min(picture.size) > 300
    # Alone, one mode or one number of tiles can be drawn too.
    write_scale_plot(tmp_path / "one.png", scale_rows([record(9, "shortlist")]))
    assert (tmp_path / "one.png").stat().st_size > 0
