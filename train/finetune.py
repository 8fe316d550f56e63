"""python -m train.finetune: enhance to be matched, by a differentiable matching and homography loss."""

from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import choice, command
from diffnav.data.match_pairs.random_views import RandomViews
from diffnav.data.pairs import TrainingPairs
from diffnav.data.viewed_pairs import ViewedPairs
from diffnav.losses.hybrid import HybridLoss
from diffnav.losses.retinex import RetinexLoss
from diffnav.training.finetune import FinetuneStage
from diffnav.training.stages import Stage
from train.enhance import enhancing_stage
from train.session import train


def make_stage(cfg: DictConfig) -> Stage:
    """The stage that `stage` and `train_decom` choose, with the matcher-aware terms where `loss` has any."""
    departures = {key: cfg[key] for key in ("reflectance", "detail") if cfg[key] is not None}
    base = enhancing_stage(cfg, departures)
    if not is_matcher_aware(base.loss):
        return base
    descriptors = {name: instantiate(choice("descriptor", name)) for name in cfg.descriptors}
    return FinetuneStage(base, base.loss, descriptors)


def make_pairs(cfg: DictConfig, pairs: TrainingPairs) -> TrainingPairs | ViewedPairs:
    """The same samples whatever the loss, with views where the loss looks at them."""
    views = dict(cfg.views)
    exposure = tuple(views.pop("exposure"))
    aware = is_matcher_aware(instantiate(cfg.loss))
    return ViewedPairs(pairs, RandomViews(**views), exposure) if aware else pairs


def is_matcher_aware(loss: RetinexLoss) -> bool:
    """Whether a loss has terms beside the paper's."""
    return isinstance(loss, HybridLoss) and loss.matcher_aware


@command("finetune")
def main(cfg: DictConfig) -> None:
    train(cfg, make_stage, make_pairs)


if __name__ == "__main__":
    main()
