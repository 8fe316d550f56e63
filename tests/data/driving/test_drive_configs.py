"""Every configuration of a driving set names each argument of its function, with the function's default."""

import inspect

import pytest
from hydra.utils import get_method, instantiate
from omegaconf import OmegaConf

from conf.command import CONF, choices

# A driving set is a target itself; other data has photos.
DRIVES = [name for name in choices("data") if "_target_" in OmegaConf.load(CONF / "data" / f"{name}.yaml")]


def test_there_are_driving_sets() -> None:
    assert {"zpark", "apollo_stereo", "apollo_roads", "four_seasons", "kitti_odometry", "paired"} <= set(DRIVES)


@pytest.mark.parametrize("name", DRIVES)
def test_no_default_stands_outside_the_configuration(name: str) -> None:
    cfg = OmegaConf.create(OmegaConf.to_container(OmegaConf.load(CONF / "data" / f"{name}.yaml")))
    parameters = inspect.signature(get_method(cfg.pop("_target_"))).parameters
    assert set(cfg) == set(parameters)
    for key, parameter in parameters.items():
        if parameter.default is not inspect.Parameter.empty:
            value = OmegaConf.to_container(cfg)[key]
            assert value == (list(parameter.default) if isinstance(parameter.default, tuple) else parameter.default)
            assert isinstance(value, bool) == isinstance(parameter.default, bool)


def test_the_street_is_built_from_its_configuration() -> None:
    drive = instantiate(OmegaConf.load(CONF / "data" / "scenes_drive.yaml"))
    assert (len(drive), drive.name) == (40, "scenes_drive")
