"""A bad query never ends a batch; a batch of nothing else ends with one sentence."""

from pathlib import Path

import pytest
import torch
from made_noise import noise
from PIL import Image
from small_site import Site, quoted, summary, table

from diffnav.images import write_image


@pytest.fixture
def bad(site: Site, tmp_path: Path) -> Path:
    """Photos that are of no use, each in its own way."""
    folder = tmp_path / "bad"
    write_image(folder / "small.png", noise((31, 200), 1))
    write_image(folder / "black.png", torch.zeros(3, 120, 160))
    whole = (site.photos / "f_1.png").read_bytes()
    (folder / "cut.png").write_bytes(whole[: len(whole) // 2])
    (folder / "text.jpg").write_text("no picture")
    # A tag, and no place in it.
    exif = Image.Exif()
    exif[0x010F] = "Camera"
    Image.open(site.photos / "f_2.png").save(folder / "tagged.jpg", exif=exif, quality=95)
    return folder


def test_bad_queries_never_end_a_batch(bad: Path, locate, site: Site, tmp_path: Path) -> None:
    (bad / "good.png").write_bytes((site.photos / "f_3.png").read_bytes())
    for workers in (1, 2):
        printed = locate(queries=bad, workers=workers, out=tmp_path / f"out_{workers}", figures=0)
        assert "6 answers, 0 of them from before, 2 with a place" in printed
        lines = {line["name"]: line for line in table(tmp_path, f"out_{workers}")}
        assert {name for name, line in lines.items() if line["status"] == "fix"} == {"good", "tagged"}
        reasons = {"small": "fewer than 32 a side", "black": "of one colour", "cut": "cut.png", "text": "text.jpg"}
        for name, part in reasons.items():
            assert part in lines[name]["reasons"]


def test_exif_without_gps_is_a_note(bad: Path, locate, tmp_path: Path) -> None:
    locate(queries=quoted(bad / "tagged.jpg"), figures=0)
    assert summary(tmp_path)["protocol"]["problems"] == ["tagged: no truth (EXIF holds no GPS position)"]
    assert summary(tmp_path)["rows"][0]["recall_5m"] is None


def test_nothing_but_bad_queries(bad: Path, mistake, tmp_path: Path) -> None:
    (bad / "tagged.jpg").unlink()
    said = mistake(queries=bad)
    assert "none of the 4 queries could be used" in said
    assert "per_query.csv says why" in said
    # What was found out is on disk all the same.
    (row,) = summary(tmp_path)["rows"]
    assert (row["queries"], row["fixes"], row["seconds"]) == (4, 0, None)
