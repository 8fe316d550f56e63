"""python -m train.decom: stage one of the paper, Decom-Net with L_Decom."""

from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import command, is_bf16
from diffnav.retinex.enhancer import RetinexEnhancer
from diffnav.training.stages import DecomStage
from train.session import train


def make_stage(cfg: DictConfig) -> DecomStage:
    """A fresh pair of networks, of which Decom-Net will be trained."""
    return DecomStage(RetinexEnhancer(**cfg.network), instantiate(cfg.loss), is_bf16(cfg.precision))


@command("decom")
def main(cfg: DictConfig) -> None:
    train(cfg, make_stage)


if __name__ == "__main__":
    main()
