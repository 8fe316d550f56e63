"""python -m train.enhance: stage two of the paper, the joint stage, or the direct rival."""

from pathlib import Path
from typing import Any

from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import command, is_bf16
from diffnav.checkpoints import build_enhancer, read_checkpoint
from diffnav.errors import UserError
from diffnav.retinex.enhancer import DirectEnhancer, Enhancer, RetinexEnhancer
from diffnav.training.stages import DirectStage, EnhanceStage, EnhancingStage
from train.session import train


def make_stage(cfg: DictConfig) -> EnhancingStage:
    """The stage that `stage`, `train_decom` and `keep_decom_loss` choose, from the checkpoint `init`."""
    return enhancing_stage(cfg, {})


def enhancing_stage(cfg: DictConfig, departures: dict[str, Any]) -> EnhancingStage:
    """The same, the Retinex network departing from `init`'s settings where `departures` says so."""
    loss, bf16 = instantiate(cfg.loss), is_bf16(cfg.precision)
    if cfg.stage not in ("retinex", "direct"):
        raise UserError(f"stage must be retinex or direct, got {cfg.stage!r}")
    if cfg.stage == "direct":
        if departures:
            raise UserError(f"{', '.join(departures)} cannot be set with stage=direct, which has no R; leave it out")
        direct = initial_enhancer(cfg, {}) if cfg.init else DirectEnhancer(**cfg.network)
        if not isinstance(direct, DirectEnhancer):
            raise UserError(f"init={cfg.init} is a Retinex network; stage=direct starts from a direct one or none")
        return DirectStage(direct, loss, bf16)
    if not cfg.init:
        raise UserError(
            "init is missing: name the run or checkpoint with the trained Decom-Net (python -m train.decom)"
        )
    enhancer = initial_enhancer(cfg, departures)
    if not isinstance(enhancer, RetinexEnhancer):
        raise UserError(f"init={cfg.init} is a direct network, which has no Decom-Net; give a Retinex checkpoint")
    decom_loss = instantiate(cfg.decom_loss) if cfg.keep_decom_loss else None
    return EnhanceStage(enhancer, loss, bf16, cfg.train_decom, decom_loss)


def initial_enhancer(cfg: DictConfig, departures: dict[str, Any]) -> Enhancer:
    """The enhancer of `init`, a run's name or a checkpoint; its settings must be those of `network`."""
    run = Path(cfg.paths.runs).expanduser() / str(cfg.init)
    enhancer = build_enhancer(read_checkpoint(run if run.is_dir() else cfg.init), departures)
    if not isinstance(enhancer, Enhancer):
        raise UserError(f"init={cfg.init} is a baseline, which is not trained here; give a Retinex checkpoint")
    for key, value in cfg.network.items():
        if enhancer.settings[str(key)] != value:
            trained = enhancer.settings[str(key)]
            raise UserError(
                f"init={cfg.init} was trained with network.{key}={trained}, now it is {value}: "
                f"give network.{key}={trained} or another checkpoint"
            )
    return enhancer


@command("enhance")
def main(cfg: DictConfig) -> None:
    train(cfg, make_stage)


if __name__ == "__main__":
    main()
