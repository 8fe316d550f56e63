"""Every configuration of training composes, and what it names can be built."""

import inspect
from collections.abc import Callable
from pathlib import Path

import pytest
from hydra import compose, initialize_config_dir
from hydra.utils import get_method, instantiate
from omegaconf import DictConfig, OmegaConf
from tiny_training import REPOSITORY

from conf.command import CONF, choices
from diffnav.checkpoints import save_enhancer
from diffnav.retinex.enhancer import RetinexEnhancer
from diffnav.training.loop import Plan
from diffnav.training.stages import DecomStage, DirectStage, EnhanceStage, Stage
from train import baseline, decom, enhance, finetune

# What a training command chooses from.
GROUPS = ("network", "darkness", "data", "loss", "optimiser", "schedule", "training")


def composed(command: str, *overrides: str) -> DictConfig:
    with initialize_config_dir(str(REPOSITORY / "conf"), version_base="1.3"):
        return compose(command, overrides=[*overrides, "run=a"])


# Those of eval.navigation are tested with it.
TRAINED = [name for name in choices("experiment") if not name.endswith("navigation")]


@pytest.mark.parametrize("name", TRAINED)
def test_experiment_composes_and_builds(name: str, tmp_path) -> None:
    """One called like a `baseline` belongs to train.baseline, matcher_* to train.finetune, *_decom to train.decom."""
    if name in choices("baseline"):
        cfg = composed("baseline", f"experiment={name}")
        stage: Stage = baseline.make_stage(cfg)
        assert stage.name == name
    elif name.startswith("matcher"):
        cfg = composed("finetune", f"experiment={name}")
        stage = finetune.make_stage(cfg)
        trained = {part.split(".")[0] for part, p in stage.enhancer.named_parameters() if p.requires_grad}
        assert trained == ({"decom", "enhance"} if name.endswith("joint") else {"enhance"})
    elif name.endswith("decom"):
        cfg = composed("decom", f"experiment={name}")
        stage = decom.make_stage(cfg)
        assert isinstance(stage, DecomStage)
    else:
        cfg = composed("enhance", f"experiment={name}")
        if cfg.stage == "retinex":
            save_enhancer(tmp_path / "decom.pt", RetinexEnhancer(**cfg.network), "decom", {})
            cfg.init = str(tmp_path / "decom.pt")
        stage = enhance.make_stage(cfg)
        assert isinstance(stage, DirectStage if cfg.stage == "direct" else EnhanceStage)
    plan = instantiate(cfg.training)
    assert isinstance(plan, Plan)
    assert stage.bf16 == (cfg.precision == "bf16")
    optimiser = instantiate(cfg.optimiser)([p for p in stage.parameters() if p.requires_grad])
    assert optimiser.param_groups[0]["lr"] == cfg.optimiser.lr
    assert 0 < instantiate(cfg.schedule).factor(0, plan.steps) <= 1


def has_photos(name: str) -> bool:
    """Whether a configuration of data is one to train on: a driving set is tested with its like."""
    return "photos" in OmegaConf.load(CONF / "data" / f"{name}.yaml")


OPTIONS = [(group, name) for group in GROUPS for name in choices(group) if group != "data" or has_photos(name)]


@pytest.mark.parametrize(("group", "name"), OPTIONS)
def test_every_option_composes_and_builds(group: str, name: str) -> None:
    needs_root = "root" in list(OmegaConf.load(CONF / group / f"{name}.yaml"))
    cfg = composed("decom", f"{group}={name}", *(["data.root=/photos"] if needs_root else []))[group]
    if group == "network":
        assert RetinexEnhancer(**cfg).settings == dict(cfg)
    elif group == "data":
        # Built without touching the folder: the function exists and takes exactly these arguments.
        arguments = {key: value for key, value in cfg.photos.items() if key != "_target_"}
        function = get_method(cfg.photos._target_)
        inspect.signature(function).bind(**arguments)
        assert set(inspect.signature(function).parameters) == set(arguments), "a default stands outside the YAML"
        assert cfg.size is None or len(cfg.size) == 2
    else:
        instantiate(cfg)


def test_zero_dce_is_trained_as_published() -> None:
    """PAPER 9: spatial 1, exposure 10 (level .6), colour 5, variation 200; decay 1e-4, batch 8, clip .1.

    The experiment departs in rate and level, and says why.
    """
    loss = composed("baseline", "baseline=zero_dce").baseline.loss
    assert (loss.spatial, loss.exposure, loss.colour, loss.variation, loss.level) == (1, 10, 5, 200, 0.6)
    cfg = composed("baseline", "experiment=zero_dce")
    assert {key: cfg.baseline.loss[key] for key in loss} == {**loss, "level": 0.5}
    assert cfg.optimiser.weight_decay == 1e-4
    assert (cfg.training.batch, cfg.training.clip_norm) == (8, 0.1)


def test_the_papers_experiments_are_the_papers() -> None:
    """PAPER 2, 3: Adam (.9, .999) at 1e-4, no schedule, batch 16, patch 96, 18,750 steps, lambdas of .01."""
    for command, name in (("decom", "paper_decom"), ("enhance", "paper_enhance")):
        cfg = composed(command, f"experiment={name}")
        assert (cfg.optimiser.lr, list(cfg.optimiser.betas)) == (1e-4, [0.9, 0.999])
        assert cfg.schedule._target_.endswith("Constant")
        assert (cfg.training.steps, cfg.training.batch, cfg.data.patch) == (18_750, 16, 96)
        assert (cfg.precision, cfg.training.clip_norm, cfg.data.augment_darkness) == ("float32", None, False)
        assert (cfg.loss.lambda_re, cfg.loss.lambda_r, cfg.loss.lambda_i, cfg.loss.lambda_tv) == (0.01, 0.01, 0.01, 10)
        assert (cfg.loss.lambda_re1, cfg.loss.lambda_re2, cfg.loss.lambda_smooth, cfg.loss.tv) == (0.5, 1.5, 1, "wei")
        assert (list(cfg.darkness.gamma), list(cfg.darkness.quality)) == ([3, 5], [95, 95])


def test_a_drive_is_nothing_to_train_on(refusal: Callable, tmp_path: Path) -> None:
    given = ["data=kitti_odometry", "device=cpu", "network.width=4", f"paths.runs={tmp_path}", "run=a"]
    said = refusal(decom.main, *given)
    assert said.startswith("error: data=kitti_odometry is a driving set, which eval.driving takes; choose one of ")
    assert list(tmp_path.iterdir()) == []
