import pytest
from hydra.utils import instantiate
from learned_checks import (
    check_any_size,
    check_arguments,
    check_features,
    check_identity,
    check_missing,
    check_moved,
    need,
)

from conf.command import choice
from diffnav.errors import UserError
from diffnav.matching.aliked import MODELS, Aliked
from diffnav.pretrained import pretrained_path

FILE = "aliked/aliked-n16.pth"


@pytest.fixture(scope="module")
def aliked():
    need(FILE)
    return Aliked()


@pytest.fixture
def small(picture):
    return picture[:, :130, :170]


def test_features_are_plain_and_the_same_each_time(aliked, small):
    check_features(aliked, small, 128, least=200)
    assert len(Aliked(features=40).features(small)) == 40


@pytest.mark.parametrize("offset", [(32, 32), (17, 11)])
def test_a_moved_picture_matches_without_offset(aliked, picture, offset):
    check_moved(aliked, picture, offset, least=200, within_px=0.15)


def test_darkness_costs_few_keypoints(aliked, small):
    assert len(aliked.features(small**4)) > 0.8 * len(aliked.features(small))


def test_any_picture_gives_finite_features(aliked):
    check_any_size(aliked, 128)


def test_a_bound_on_the_cosine_keeps_the_similar(aliked, small):
    a, b = aliked.features(small.rot90(1, (1, 2))), aliked.features(small)
    free, bound = aliked.match(a, b), Aliked(min_cosine=0.5).match(a, b)
    assert 0 < len(bound) < len(free)
    assert (bound.confidence > 0.5).all()


def test_the_settings_name_model_and_weights(aliked):
    own = {"features": 500, "min_cosine": -1.0, "model": "aliked-n16"}
    assert {key: aliked.settings[key] for key in aliked.settings if "weights" not in key} == own
    check_identity(aliked.settings, pretrained_path(FILE, ""))


def test_a_row_is_named_after_the_model():
    need(FILE, "aliked/aliked-n16rot.pth")
    upright, turned = (instantiate(choice("matcher", name)) for name in ("aliked", "aliked_rot"))
    assert (upright.name, turned.name) == ("aliked", "aliked_rot")
    assert turned.settings["weights"] == "aliked-n16rot.pth"
    assert turned.settings["weights_sha256"] != upright.settings["weights_sha256"]
    assert len(set(MODELS.values())) == len(MODELS)


@pytest.mark.parametrize("model", MODELS)
def test_missing_weights_are_one_sentence(model, tmp_path, monkeypatch):
    check_missing(lambda: Aliked(model=model), tmp_path, monkeypatch, f"aliked/{model}.pth", "Shiaoming/ALIKED")


@pytest.mark.parametrize(("setting", "value"), [("features", 0), ("min_cosine", -2), ("model", "aliked-n17")])
def test_settings_out_of_range_are_named(setting, value):
    with pytest.raises(UserError, match=rf"matcher\.{setting}"):
        Aliked(**{setting: value})


def test_the_configurations_hold_every_argument():
    check_arguments("aliked", Aliked)
    check_arguments("aliked_rot", Aliked, model="aliked-n16rot")
