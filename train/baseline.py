"""python -m train.baseline: LightenNet and Zero-DCE, trained on the same photographs as ours."""

from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import command, is_bf16
from diffnav.training.stages import Stage
from train.session import train


def make_stage(cfg: DictConfig) -> Stage:
    """The fresh network that `baseline` chooses, with its losses."""
    return instantiate(cfg.baseline, bf16=is_bf16(cfg.precision))


@command("baseline")
def main(cfg: DictConfig) -> None:
    train(cfg, make_stage)


if __name__ == "__main__":
    main()
