"""The experiment on a handful of tiny pictures: what is run, timed, recorded, re-used, and what happens to failures."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from torch import Tensor, nn

from diffnav.darkness import Darkening, DarknessModel, darken
from diffnav.data.pair_source import PairSource
from diffnav.data.pairs import photo_seed
from diffnav.data.photos import Photo, folder_photos
from diffnav.enhancers.gamma_blind import GammaBlind
from diffnav.enhancers.gamma_oracle import GammaOracle
from diffnav.enhancers.input import Input
from diffnav.errors import UserError
from diffnav.evaluation.enhancement import measure
from diffnav.evaluation.methods import Method
from diffnav.evaluation.predictions import PredictionCache
from diffnav.evaluation.records import ImageRecord, RecordLog
from diffnav.evaluation.rows import enhancement_rows
from diffnav.evaluation.runner import ComponentWatch, Runner
from diffnav.images import read_image, write_image
from diffnav.retinex.enhancer import RetinexEnhancer
from diffnav.retinex.state import component_state
from diffnav.scores import psnr, ssim

SIZES = {"east/one": (24, 32), "east/two": (17, 45), "west/three": (40, 24)}


class Counting(nn.Module):
    """Brightens; fails on pictures of one width, and counts its calls."""

    def __init__(self, fails_at_width: int | None = None, error: Exception | None = None) -> None:
        super().__init__()
        self.calls = 0
        self.fails_at_width = fails_at_width
        self.error = error or RuntimeError("out of memory")

    def forward(self, image: Tensor, record: Sequence[Darkening] | None = None) -> Tensor:  # noqa: ARG002
        self.calls += 1
        if image.shape[3] == self.fails_at_width:
            raise self.error
        return (image * 1.5 + 0.01).clamp(0, 1)


@pytest.fixture
def photos(tmp_path: Path) -> list[Photo]:
    for number, (name, size) in enumerate(SIZES.items()):
        y, x = torch.meshgrid(torch.arange(size[0]), torch.arange(size[1]), indexing="ij")
        waves = torch.stack([0.55 + 0.4 * torch.sin((x + number) / (4 + k)) * torch.cos(y / 5) for k in range(3)])
        write_image(tmp_path / "photos" / f"{name}.png", waves)
    return folder_photos(tmp_path / "photos")


def log_in(path: Path | None = None) -> RecordLog[ImageRecord]:
    return RecordLog(path, ImageRecord)


def runners(cache: PredictionCache | None = None, **enhancers: nn.Module) -> list[Runner]:
    return [Runner(Method(name, e.eval(), {}), cache or PredictionCache(None)) for name, e in enhancers.items()]


def test_records_hold_independently_computed_scores(photos: list[Photo]) -> None:
    source = PairSource(photos, DarknessModel(), seed=7)
    result = measure(source, runners(input=Input(), gamma_oracle=GammaOracle()), log_in())
    assert result.problems == []
    assert [(r.name, r.method) for r in result.records] == [(n, m) for n in SIZES for m in ("input", "gamma_oracle")]
    for record in result.records:
        normal = read_image(next(p.normal for p in photos if p.name == record.name))
        drawn = DarknessModel().draw(normal.max().item(), photo_seed(7, record.name))
        low = darken(normal, drawn)
        if record.method == "gamma_oracle":
            low = drawn.maximum * (low / drawn.maximum) ** (1 / drawn.gamma)
        assert record.gamma == drawn.gamma
        assert (record.height, record.width) == SIZES[record.name]
        assert record.site == record.name.split("/")[0]
        assert record.psnr == pytest.approx(psnr(low[None], normal[None]).item(), abs=1e-3)
        assert record.ssim == pytest.approx(ssim(low[None], normal[None]).item(), abs=1e-5)
        assert record.seconds is not None
        assert record.seconds >= 0


def test_the_first_picture_runs_twice_for_the_warm_up(photos: list[Photo]) -> None:
    enhancer = Counting()
    measure(PairSource(photos, DarknessModel()), runners(a=enhancer), log_in())
    assert enhancer.calls == len(photos) + 1


def test_a_second_call_computes_only_what_is_new(photos: list[Photo], tmp_path: Path) -> None:
    source, path = PairSource(photos, DarknessModel()), tmp_path / "out" / "records.jsonl"
    first = measure(source, runners(a=Counting()), log_in(path))
    again, log = Counting(), log_in(path)
    second = measure(source, runners(renamed=again), log)
    assert again.calls == 0
    assert log.reused == len(photos)
    assert [replace(r, method="a") for r in second.records] == first.records
    other_darkness = Counting()
    measure(PairSource(photos, DarknessModel(), seed=1), runners(a=other_darkness), log_in(path))
    assert other_darkness.calls == len(photos) + 1


def test_a_killed_evaluation_goes_on(photos: list[Photo], tmp_path: Path) -> None:
    """Half a line at the end of the records is dropped, and only that picture is computed again."""
    source, path = PairSource(photos, DarknessModel()), tmp_path / "records.jsonl"
    first = measure(source, runners(a=Counting()), log_in(path))
    path.write_text(path.read_text()[:-40])
    enhancer = Counting()
    second = measure(source, runners(a=enhancer), log_in(path))
    assert enhancer.calls == 1 + 1
    assert [r.psnr for r in second.records] == [r.psnr for r in first.records]
    assert all(json.loads(line) for line in path.read_text().splitlines())
    assert log_in(path).find(second.records[-1].key) is not None


def test_the_cache_serves_another_output_folder(photos: list[Photo], tmp_path: Path) -> None:
    source, cache = PairSource(photos, DarknessModel()), PredictionCache(tmp_path / "cache")
    first = measure(source, runners(cache, a=Counting()), log_in())
    again = Counting()
    second = measure(source, runners(cache, a=again), log_in())
    assert again.calls == 0
    assert second.records == first.records


def test_failures_are_named_counted_and_tried_again(photos: list[Photo], tmp_path: Path) -> None:
    source, path = PairSource(photos, DarknessModel()), tmp_path / "records.jsonl"
    failing = runners(input=Input(), a=Counting(fails_at_width=45))
    records = measure(source, failing, log_in(path)).records
    failed = next(r for r in records if r.failure)
    assert (failed.name, failed.failure, failed.seconds) == ("east/two", "out of memory", None)
    untouched = next(r for r in records if r.method == "input" and r.name == "east/two")
    assert (failed.psnr, failed.ssim) == (untouched.psnr, untouched.ssim)
    row = enhancement_rows([r.method for r in failing], records, reference=None)[1]
    assert (row["n"], row["failures"]) == (3, [{"name": "east/two", "why": "out of memory"}])
    assert row["psnr"] == pytest.approx(sum(r.psnr for r in records if r.method == "a") / 3, abs=1e-5)
    mended = runners(a=Counting())
    assert all(r.failure is None for r in measure(source, mended, log_in(path)).records)


def test_a_programming_error_is_no_failure_of_a_picture(photos: list[Photo]) -> None:
    with pytest.raises(AttributeError):
        measure(PairSource(photos, DarknessModel()), runners(a=Counting(45, AttributeError("typo"))), log_in())


@pytest.mark.parametrize("result", [torch.full((1, 3, 24, 32), torch.nan), torch.zeros(1, 3, 4, 4)])
def test_a_result_that_is_no_picture_is_a_failure(result: Tensor, photos: list[Photo]) -> None:
    class Broken(nn.Module):
        def forward(self, image: Tensor, record: object = None) -> Tensor:  # noqa: ARG002
            return result

    (record,) = measure(PairSource(photos[:1], DarknessModel()), runners(a=Broken()), log_in()).records
    assert record.failure is not None
    assert "NaN" in record.failure


def test_a_method_without_any_result_has_no_scores(photos: list[Photo]) -> None:
    """The oracle on real pairs: nothing tells how they were darkened."""
    real = [replace(photo, low=photo.normal) for photo in photos]
    parts = runners(input=Input(), gamma_oracle=GammaOracle())
    rows = enhancement_rows(
        [r.method for r in parts], measure(PairSource(real, DarknessModel()), parts, log_in()).records
    )
    assert rows[0]["psnr"] == pytest.approx(120)
    assert [rows[1][key] for key in ("psnr", "psnr_ci", "ssim", "seconds", "n")] == [None, None, None, None, 0]
    assert len(rows[1]["failures"]) == 3


def test_unreadable_photos_are_named_and_the_others_measured(photos: list[Photo], tmp_path: Path) -> None:
    Path(str(photos[1].normal)).write_bytes(b"\x89PNG broken")
    write_image(tmp_path / "photos" / "tiny.png", torch.zeros(3, 5, 5))
    every = [*folder_photos(tmp_path / "photos"), Photo("dark", "x", None, low=tmp_path / "dark.png")]
    result = measure(PairSource(every, DarknessModel()), runners(input=Input()), log_in())
    assert [r.name for r in result.records] == ["east/one", "west/three"]
    assert len(result.problems) == 3
    for name, problem in zip(("two.png", "tiny.png", "dark.png"), result.problems, strict=True):
        assert name in problem
    with pytest.raises(UserError, match=r"none of 1 photos can be used: .*tiny\.png"):
        measure(PairSource(every[2:3], DarknessModel()), runners(input=Input()), log_in())


def test_photos_are_resized_where_a_size_is_given(photos: list[Photo]) -> None:
    records = measure(PairSource(photos, DarknessModel(), size=(16, 20)), runners(a=Input()), log_in()).records
    assert {(r.height, r.width) for r in records} == {(16, 20)}


def test_the_state_is_that_of_the_forward_pass(photos: list[Photo]) -> None:
    torch.manual_seed(0)
    enhancer = RetinexEnhancer(width=4).eval()
    source = PairSource(photos, DarknessModel())
    records = measure(source, runners(net=enhancer, input=Input()), log_in()).records
    with torch.no_grad():
        expected = component_state(enhancer.components(source.read(photos[0])["low"][None]))
    assert records[0].state == pytest.approx({name: value.item() for name, value in expected.items()}, abs=1e-6)
    assert records[1].state == {}
    assert not enhancer.enhance._forward_hooks
    rows = enhancement_rows([r.method for r in runners(net=enhancer, input=Input())], records, reference="input")
    states = [r.state["Ih_mean"] for r in records if r.method == "net"]
    assert rows[0]["state"]["Ih_mean"] == pytest.approx(sum(states) / 3, abs=1e-6)
    assert rows[0]["illumination_alive"] is (rows[0]["state"]["Ih_std"] >= 0.02)
    assert (rows[1]["state"], rows[1]["illumination_alive"]) == (None, None)


def test_the_state_of_a_tiled_picture_is_its_tiles_mean() -> None:
    enhancer = RetinexEnhancer(width=4).eval()
    enhancer.tile_pixels = 240 * 240
    watch = ComponentWatch(enhancer)
    with watch, torch.no_grad():
        enhancer(torch.rand(1, 3, 200, 420))
    assert len(watch._states) > 1
    assert watch.means()["R_mean"] == pytest.approx(torch.stack([s["R_mean"] for s in watch._states]).mean().item())


def test_rows_aggregate_the_records(photos: list[Photo]) -> None:
    parts = runners(input=Input(), gamma_blind=GammaBlind())
    records = measure(PairSource(photos, DarknessModel()), parts, log_in()).records
    dark, blind = enhancement_rows([r.method for r in parts], records, seed=3)
    ours = [r for r in records if r.method == "gamma_blind"]
    rivals = [r for r in records if r.method == "input"]
    assert blind["psnr"] == pytest.approx(sum(r.psnr for r in ours) / 3, abs=1e-5)
    assert blind["psnr_ci"][0] <= blind["psnr"] <= blind["psnr_ci"][1]
    assert blind["seconds"] == pytest.approx(sorted(r.seconds for r in ours)[1], abs=1e-6)
    assert blind["per_source"]["east"] == {
        "n": 2,
        "psnr": pytest.approx((ours[0].psnr + ours[1].psnr) / 2, abs=1e-5),
        "ssim": pytest.approx((ours[0].ssim + ours[1].ssim) / 2, abs=1e-5),
    }
    assert blind["versus"] is None
    gaps = [a.psnr - b.psnr for a, b in zip(rivals, ours, strict=True)]
    assert dark["versus"]["reference"] == "gamma_blind"
    assert dark["versus"]["psnr"][0] == pytest.approx(sum(gaps) / 3, abs=1e-5)
    assert min(gaps) - 1e-6 <= dark["versus"]["psnr"][1] <= dark["versus"]["psnr"][2] <= max(gaps) + 1e-6


def test_a_file_of_something_else_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "records.jsonl").write_text('{"mine": 1}\n')
    with pytest.raises(UserError, match="not the records"):
        log_in(tmp_path / "records.jsonl")
    assert (tmp_path / "records.jsonl").read_text() == '{"mine": 1}\n'
