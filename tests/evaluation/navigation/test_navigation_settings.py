"""The YAML of eval.navigation says what the code says, each of its groups composes, and the paper's experiment runs."""

import inspect
import json
from dataclasses import asdict
from itertools import product
from pathlib import Path

import pytest
import torch
from hydra import compose, initialize_config_dir
from hydra.utils import get_method, instantiate
from omegaconf import DictConfig, OmegaConf
from small_site import Site, bounds, quoted, summary

from conf.command import CONF, choices
from diffnav.checkpoints import save_enhancer
from diffnav.darkness import DarknessModel
from diffnav.data.maps.world import world_maps
from diffnav.evaluation.navigation.known import Known
from diffnav.evaluation.navigation.searcher import Tiles
from diffnav.navigation.correlator import CorrelationSearch
from diffnav.navigation.gates.calibration import read_gates, shipped_gates
from diffnav.navigation.localizer import Search
from diffnav.navigation.plausibility import Plausibility
from diffnav.retinex.enhancer import RetinexEnhancer


def composed(*overrides: str) -> DictConfig:
    with initialize_config_dir(str(CONF), version_base="1.3"):
        return compose("navigation", overrides=list(overrides))


@pytest.mark.parametrize(("maps", "query_set"), list(product(choices("maps"), choices("query_set"))))
def test_every_group_composes_with_the_arguments_of_its_target(maps: str, query_set: str):
    cfg = composed(f"maps={maps}", f"query_set={query_set}", "map=a.tif", "queries=photos")
    for group, given in (("maps", set()), ("query_set", {"maps", "darkness", "seed"})):
        settings = OmegaConf.to_container(cfg[group], resolve=True)
        arguments = inspect.signature(get_method(cfg[group]._target_)).parameters
        own = {key: value for key, value in settings.items() if not key.startswith("_")}
        assert own.keys() | given == set(arguments)
        for key, value in own.items():
            default = arguments[key].default
            if default is not inspect.Parameter.empty and not isinstance(value, dict) and key != "cache":
                assert value == (list(default) if isinstance(default, tuple) else default), key


@pytest.mark.parametrize(
    ("part", "default"),
    [
        ("tiles", Tiles()),
        ("search", Search()),
        ("correlation", CorrelationSearch()),
        ("plausibility", Plausibility()),
        ("prior", Known()),
    ],
)
def test_defaults_stand_once(part: str, default):
    plain = json.loads(json.dumps(asdict(default)))
    assert json.loads(json.dumps(asdict(instantiate(composed()[part])), default=list)) == plain


def test_query_sets_are_what_they_say(site: Site):
    maps = world_maps(0, 2, (600, 900))
    cut = instantiate(composed("query_set=cut", "query_set.off_map=3").query_set)(maps, DarknessModel(), 0)
    assert [query.on_map for query in cut.queries] == [True] * 20 + [False] * 3
    assert sum(query.dark for query in cut.queries[:20]) == 10
    photos = instantiate(composed(f'queries="{site.photos}"').query_set)(maps, DarknessModel(), 0)
    assert [query.name for query in photos.queries] == ["f_1", "f_2", "f_3", "f_4"]


PAPER = {
    "experiment": "paper_navigation",
    "tiles.size": "[200,240]",
    "tiles.features": 2000,
    "features": 500,
    "gate": "always",
    "figures": 0,
}


def test_the_paper_s_experiment_in_small(locate, tmp_path: Path):
    small = {"map": ..., "queries": ..., "maps.bounds": ..., "always": ..., "checkpoint": "[]"}
    small |= {"maps.count": 1, "maps.size": "[400,480]", "query_set.per_map": 2, "query_set.size": "[160,200]"}
    locate(**(PAPER | small))
    rows, protocol = (summary(tmp_path)[key] for key in ("rows", "protocol"))
    # Two by two tiles without overlap, each tried in turn; of two pictures one is dark.
    assert (protocol["map_tiles"], protocol["tiles"]["overlap"]) == ([4], 0.0)
    assert protocol["search"]["winner"] == "matches"
    assert protocol["kinds"] == {"maps": "world", "query_set": "cut"}
    assert [(row["method"], row["matcher"], row["mode"], row["queries"]) for row in rows] == [
        (method, "orb_gms", "exhaustive", 1) for method in ("input", "gamma_blind", "normal")
    ] * 2
    assert {row["condition"] for row in rows} == {"day", "dark"}


def test_the_paper_s_experiment_on_own_maps_and_photos(locate, tmp_path: Path):
    own = PAPER | {"always": "[input]", "maps": "file"}
    locate(**(own | {"queries": ..., "query_set.per_map": 1, "query_set.size": "[120,160]"}))
    assert summary(tmp_path)["protocol"]["kinds"] == {"maps": "file", "query_set": "cut"}
    locate(**(own | {"query_set": "folder", "query_set.darken": "true"}))
    rows = {row["condition"]: row for row in summary(tmp_path)["rows"]}
    assert {light: row["queries"] for light, row in rows.items()} == {"day": 2, "dark": 2}
    assert rows["day"]["fixes"] == 2


def test_the_whole_paper_s_experiment_composes():
    cfg = composed("experiment=paper_navigation")
    maps = instantiate(cfg.maps)
    assert [one.size for one in maps] == [(3600, 7200)] * 5
    assert [len(instantiate(cfg.tiles).windows(one)) for one in maps] == [9] * 5
    queries = instantiate(cfg.query_set)(maps, instantiate(cfg.darkness), cfg.seed).queries
    assert (len(queries), sum(query.dark for query in queries)) == (50, 25)
    assert cfg.gate == "definition"


@pytest.fixture
def network(tmp_path: Path) -> Path:
    torch.manual_seed(0)
    save_enhancer(tmp_path / "small.pt", RetinexEnhancer(width=4), "joint", {})
    return tmp_path / "small.pt"


def test_gates_are_calibrated_alone_and_used_later(locate, site: Site, network: Path, tmp_path: Path, mistake):
    alone = {"map": ..., "maps.bounds": ..., "queries": ...}
    printed = locate(**alone, calibrate=quoted(site.photos), checkpoint=network)
    gates = tmp_path / "out" / "gates.json"
    found = read_gates(gates)
    assert printed.startswith(f"{gates}: the definition gate, {found.definition.threshold:.2f}, passes ")
    assert (found.fitted_on["pictures"], found.fitted_on["enhancer"]) == (4, "small")
    assert list(tmp_path.joinpath("out").iterdir()) == [gates]
    locate(gates=gates, gate="definition", checkpoint=network, limit=1, figures=0)
    assert summary(tmp_path)["protocol"]["gate_threshold"] == found.definition.threshold
    locate(gates=gates, gate="benefit", checkpoint=network, limit=1, figures=0)
    assert summary(tmp_path)["protocol"]["gate_threshold"] == found.benefit.threshold
    (tmp_path / "other.json").write_text("{}")
    assert "not a calibration of the gates" in mistake(gates=tmp_path / "other.json")
    assert "no folder /nowhere" in mistake(calibrate="/nowhere", checkpoint=network)


def test_the_shipped_gates_are_the_default(locate, tmp_path: Path):
    locate(limit=1, figures=0)
    shipped, protocol = shipped_gates(), summary(tmp_path)["protocol"]
    assert protocol["gate"] == composed().gate
    assert protocol["gate_threshold"] == shipped.gate(composed().gate).threshold > 0


def test_settings_of_matchers(locate, tmp_path: Path):
    """One number of features for all, unless a matcher has its own; what is named twice is one row."""
    named = "[sift,sift,{sift: {features: 50}}]"
    locate(matchers=named, modes="[exhaustive,exhaustive]", limit=1, figures=0, **{"plausibility.min_inliers": 5})
    rows = summary(tmp_path)["rows"]
    assert [row["matcher"] for row in rows] == ["sift", "sift(features=50)"]
    with (tmp_path / "out" / "records.jsonl").open() as file:
        matches = [json.loads(line)["answer"]["matches"] for line in file]
    assert matches[0] > 50 >= matches[1]


def test_a_map_may_be_cut_by_other_bounds(locate, tmp_path: Path):
    """A corrected georeference of the same picture is another map: nothing old is found again."""
    locate(limit=1, figures=0)
    north, west, south, east = 47.0010, 8.0, 47.0001, 8.00176
    printed = locate(limit=1, figures=0, **{"maps.bounds": bounds((north, west, south, east))})
    assert "1 answers, 0 of them from before" in printed
    (row,) = summary(tmp_path)["rows"]
    # A ten-thousandth of a degree to the north.
    assert row["median_m"] == pytest.approx(11.12, abs=0.05)
