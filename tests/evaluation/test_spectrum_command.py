"""The experiment of eval.spectrum: its records and rows, methods that fail, the command from end to end."""

import csv
import json
import sys
from functools import partial

import pytest
import torch
from matching_stubs import Brighten, photos
from PIL import Image

from diffnav.checkpoints import save_enhancer
from diffnav.darkness import DarknessModel
from diffnav.data.pair_source import PairSource
from diffnav.data.photos import Photo
from diffnav.enhancers.input import Input
from diffnav.enhancers.normal import Normal
from diffnav.errors import UserError
from diffnav.evaluation.methods import Method
from diffnav.evaluation.predictions import PredictionCache
from diffnav.evaluation.runner import Runner
from diffnav.evaluation.spectrum import measure_spectra, spectrum_rows
from diffnav.evaluation.spectrum_page import bands_table, spectrum_page, write_spectrum_plot
from diffnav.retinex.enhancer import RetinexEnhancer
from eval.spectrum import main


def runner(method: str, enhancer: torch.nn.Module) -> Runner:
    return Runner(Method(method, enhancer.eval(), {}), PredictionCache(None))


def test_rows_have_means_of_all_photos_and_a_networks_parts():
    torch.manual_seed(0)
    runners = [runner("normal", Normal()), runner("net", RetinexEnhancer(width=4))]
    source = PairSource([*photos(2), Photo("none", "site_0", None, partial(torch.rand, 3, 64, 64))], DarknessModel())
    measured = measure_spectra(source, runners)
    assert len(measured.problems) == 1
    assert [(r.label, r.name) for r in measured.records] == [
        (label, name) for name in ("p0", "p1") for label in ("normal", "net", "net: R", "net: Ih")
    ]
    rows = spectrum_rows(measured.records)
    assert [(row["method"], row["n"]) for row in rows] == [("normal", 2), ("net", 2), ("net: R", 2), ("net: Ih", 2)]
    # 64 x 80 pixels: their lowest frequency is 1/80, in the last band with 1/64.
    assert [band["n"] for band in rows[0]["bands"]] == [2] * 6
    assert [band["coherence"] for band in rows[0]["bands"]] == pytest.approx([1] * 6, abs=0.01)
    first, second = (r.bands[1].gain for r in measured.records if r.label == "net: R")
    assert rows[2]["bands"][1]["gain"] == pytest.approx((first + second) / 2, abs=1e-6)
    assert rows[2]["bands"][1]["gain_ci"] == pytest.approx(sorted([first, second]), abs=1e-6)


class FailsLater(Brighten):
    """Works on the first photo: the warm-up and the run."""

    def forward(self, image, record=None):
        self.fails = self.calls >= 2
        return super().forward(image, record)


def test_a_method_that_fails(tmp_path):
    source = PairSource(photos(2), DarknessModel())
    runners = [runner("input", Input()), runner("later", FailsLater()), runner("never", Brighten(fails=True))]
    measured = measure_spectra(source, runners)
    by_place = {(r.method, r.name): r for r in measured.records}
    # What would go on is the dark input.
    assert by_place["later", "p1"].bands == by_place["input", "p1"].bands
    assert by_place["later", "p0"].bands != by_place["input", "p0"].bands
    rows = spectrum_rows(measured.records)
    assert [row["n"] for row in rows] == [2, 2, 0]
    assert rows[1]["failures"] == [{"name": "p1", "why": "out of memory"}]
    assert rows[2]["bands"][0]["coherence"] is None
    page = spectrum_page(rows, {})
    assert "- later on p1: out of memory\n- never on all 2: out of memory" in page
    write_spectrum_plot(tmp_path / "spectrum.png", rows)
    assert (tmp_path / "spectrum.png").stat().st_size > 0


def test_no_photo_at_all():
    with pytest.raises(UserError, match="none of 1 photos can be used"):
        measure_spectra(PairSource([Photo("a", "a", None, partial(torch.rand, 3, 64, 64))], DarknessModel()), [])


def test_the_command(tmp_path, monkeypatch, capsys):
    torch.manual_seed(0)
    save_enhancer(tmp_path / "small.pt", RetinexEnhancer(width=4), "joint", {})
    out = tmp_path / "out"
    given = ["data=scenes", "data.photos.count=3", "data.photos.size=[150,133]", "limit=2", "always=[input,normal]"]
    given += [f"checkpoint={tmp_path / 'small.pt'}", f"out={out}", f"cache={tmp_path / 'cache'}", "device=cpu"]
    monkeypatch.setattr(sys, "argv", ["eval.spectrum", *given])
    main()
    assert "5 rows over 2 photos" in capsys.readouterr().out
    content = json.loads((out / "spectrum.json").read_text())
    rows = {row["method"]: row for row in content["rows"]}
    assert list(rows) == ["input", "normal", "small", "small: R", "small: Ih"]
    assert content["protocol"]["n"] == 2
    assert content["protocol"]["weights_sha256"].keys() == {"small"}
    for band in rows["normal"]["bands"]:
        assert (band["coherence"], band["gain"]) == pytest.approx((1, 1), abs=1e-2)
    assert rows["input"]["bands"][0]["gain"] < 0.95
    with (out / "spectrum.csv").open() as file:
        table = [line for line in csv.DictReader(file) if line["method"] == "small: R" and line["high"] == "0.25"]
    assert sum(float(line["gain"]) for line in table) / 2 == pytest.approx(
        rows["small: R"]["bands"][1]["gain"], abs=1e-6
    )
    page = (out / "spectrum.md").read_text()
    assert bands_table(content["rows"], "coherence") in page
    assert bands_table(content["rows"], "gain") in page
    with Image.open(out / "spectrum.png") as plot:
        assert min(plot.size) > 200
