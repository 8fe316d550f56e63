"""Samples of photos, both gates fitted on them, and the file that keeps them."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from torch import nn

import diffnav
from diffnav.darkness import DarknessModel, darken
from diffnav.data.photos import Photo
from diffnav.data.scene_photos import scene_photos
from diffnav.data.scenes import SceneWindows
from diffnav.errors import UserError
from diffnav.matching.sift import Sift
from diffnav.navigation.gates.calibration import (
    Calibration,
    fit_gates,
    judge_gates,
    read_gates,
    shipped_gates,
    write_gates,
)
from diffnav.navigation.gates.gate import Always, BenefitGate, DefinitionGate, Never
from diffnav.navigation.gates.samples import GateSample, gate_samples

DARK = DarknessModel(gamma=(4.0, 4.0))


class Root(nn.Module):
    """The inverse of a gamma of 4."""

    def forward(self, image):
        return image**0.25


@pytest.fixture(scope="module")
def photos():
    return scene_photos(4, seed=3, size=(128, 192))


@pytest.fixture(scope="module")
def by_night(photos):
    return gate_samples(photos, Root(), [Sift()], seed=1, lights=[DARK])[0]


def test_enhancement_helps_by_night_and_not_by_day(photos, by_night):
    by_day, problems = gate_samples(photos, Root(), [Sift()], seed=1, lights=[None])
    assert problems == []
    assert all(s.matches_enhanced > s.matches_as_taken for s in by_night)
    assert all(s.matches_enhanced < s.matches_as_taken for s in by_day)
    for night, day in zip(by_night, by_day, strict=True):
        assert night.log_average_level < day.log_average_level
        assert (night.gamma, day.gamma) == (4, 1)
        assert day.definition == day.definition_normal == night.definition_normal
        assert night.definition_dark == day.definition_dark < day.definition_normal


def test_all_matchers_count_together(photos, by_night):
    once = gate_samples(photos[:1], Root(), [Sift()], seed=1, lights=[DARK])[0][0]
    twice = gate_samples(photos[:1], Root(), [Sift(), Sift()], seed=1, lights=[DARK])[0][0]
    assert once == by_night[0]
    assert twice.matches_as_taken == 2 * once.matches_as_taken
    assert twice.matches_enhanced == 2 * once.matches_enhanced


def test_a_sample_follows_from_seed_and_name_alone(photos):
    few, _ = gate_samples(photos[:2], Root(), [], seed=5)
    turned, _ = gate_samples(photos[1::-1], Root(), [], seed=5)
    assert few == turned[::-1]
    assert gate_samples(photos[:2], Root(), [], seed=6)[0] != few


def test_a_photo_that_cannot_be_read_is_told_and_passed_over(photos, tmp_path):
    missing = Photo("gone", "site", tmp_path / "gone.jpg")
    samples, problems = gate_samples([missing, photos[0]], Root(), [])
    assert [sample.name for sample in samples] == [photos[0].name]
    assert problems == [f"{tmp_path}/gone.jpg: no such file"]
    with pytest.raises(UserError, match=r"none of 1 photos can be read .*gone\.jpg"):
        gate_samples([missing], Root(), [])


SAMPLES = [
    GateSample("a", 10.0, 2.0, 3.0, 2.5, 5.0, 10, 100),
    GateSample("b", 12.0, 4.0, 2.0, 6.5, 15.0, 50, 70),
    GateSample("c", 14.0, 6.0, 1.0, 14.0, 45.0, 300, 100),
]


def test_both_thresholds_are_fitted():
    fitted = fit_gates(SAMPLES, {"photos": 3})
    assert fitted.definition.threshold == 8
    assert fitted.benefit.threshold == 30
    assert fitted.benefit.matches == {
        "never": 120, "always": 90, "definition": pytest.approx(470 / 3), "benefit": pytest.approx(470 / 3),
        "best": pytest.approx(470 / 3),
    }  # fmt: skip
    assert fitted.fitted_on == {"photos": 3}


def test_other_samples_judge_the_same_thresholds():
    judged = judge_gates(8.0, 30.0, [replace(SAMPLES[0], definition_dark=9.0, matches_enhanced=5, definition=9.0)])
    assert judged.definition.dark_passed == 1
    assert judged.benefit.harmed == 1
    assert judged.benefit.matches == {"never": 10, "always": 5, "definition": 10, "benefit": 5, "best": 10}


def test_gates_by_name():
    fitted = fit_gates(SAMPLES)
    assert fitted.gate("never") == Never()
    assert fitted.gate("always") == Always()
    assert fitted.gate("definition") == DefinitionGate(8)
    assert fitted.gate("benefit") == BenefitGate(30)
    with pytest.raises(UserError, match="gate must be one of never, always, definition, benefit, got sometimes"):
        fitted.gate("sometimes")


def test_a_file_keeps_everything(tmp_path):
    fitted = replace(fit_gates(SAMPLES, {"seed": 3, "enhancer": "größe"}), validation={"missed": 0.1})
    write_gates(tmp_path / "new" / "gates.json", fitted)
    assert read_gates(tmp_path / "new" / "gates.json") == fitted
    content = json.loads((tmp_path / "new" / "gates.json").read_text())
    assert content["definition"]["threshold"] == 8
    assert {"dark_passed", "normal_enhanced", "balanced_accuracy"} <= content["definition"].keys()


@pytest.mark.parametrize("content", ["", "{", "[]", "{}", '{"definition": {}, "benefit": {}, "fitted_on": {}}', "\xff"])
def test_a_damaged_file_is_named(tmp_path, content):
    path = tmp_path / "gates.json"
    path.write_bytes(content.encode("latin-1"))
    with pytest.raises(UserError, match=r"gates\.json: not a calibration"):
        read_gates(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(UserError, match=r"gone\.json: cannot be read"):
        read_gates(tmp_path / "gone.json")
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"gates\.json: cannot be written"):
        write_gates(tmp_path / "file" / "gates.json", fit_gates(SAMPLES))


class TestShipped:
    @pytest.fixture
    def shipped(self) -> Calibration:
        return shipped_gates()

    def test_it_says_on_what_it_was_fitted_and_how_it_errs(self, shipped):
        assert {"photos", "seed", "enhancer", "matchers"} <= shipped.fitted_on.keys()
        assert shipped.definition.balanced_accuracy > 0.5
        matches = shipped.validation["benefit"]["matches"]
        assert matches["benefit"] > max(matches["never"], matches["always"], matches["definition"])

    def test_it_brightens_the_embedded_world_by_night_alone(self, shipped):
        gate = shipped.gate("benefit")
        for seed, (_, picture) in enumerate(SceneWindows(seed=21, count=4, size=(128, 192))):
            dark = darken(picture, DarknessModel().draw(picture.max().item(), seed))
            assert gate.enhances(dark)[0]
            assert not gate.enhances(picture)[0]

    def test_a_black_picture_is_enhanced_by_both(self, shipped):
        assert shipped.gate("benefit").enhances(torch.zeros(3, 20, 20))[0]
        assert shipped.gate("definition").enhances(torch.zeros(3, 20, 20))[0]

    def test_it_lies_inside_the_package(self, shipped):
        assert read_gates(Path(diffnav.__file__).parent / "navigation" / "gates" / "shipped.json") == shipped
