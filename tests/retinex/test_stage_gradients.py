"""Which network each stage of training reaches."""

import torch

from diffnav.losses.retinex import RetinexLoss
from diffnav.retinex.enhancer import RetinexEnhancer
from diffnav.training.stages import DecomStage, EnhanceStage


def make_enhancer() -> RetinexEnhancer:
    torch.manual_seed(0)
    return RetinexEnhancer(width=6)


def make_pair() -> list[torch.Tensor]:
    dice = torch.Generator().manual_seed(1)
    return [torch.rand(2, 3, 16, 16, generator=dice).requires_grad_() for _ in range(2)]


def gradient(module: torch.nn.Module) -> float:
    return sum(p.grad.abs().sum().item() for p in module.parameters() if p.grad is not None)


def test_stage_one_reaches_decom_net_from_both_images():
    """The reflectance term holds no image but what Decom-Net makes of it: a gradient there passed through it."""
    enhancer, (low, normal) = make_enhancer(), make_pair()
    losses, _ = DecomStage(enhancer, RetinexLoss())(low, normal)
    for term in ("reflectance", "illumination"):
        low.grad = normal.grad = None
        losses[term].backward(retain_graph=True)
        assert low.grad.abs().sum() > 0, term
        assert normal.grad.abs().sum() > 0, term
    assert gradient(enhancer.decom) > 0
    assert gradient(enhancer.enhance) == 0


def test_stage_two_gives_decom_net_none():
    enhancer, (low, normal) = make_enhancer(), make_pair()
    losses, _ = EnhanceStage(enhancer, RetinexLoss())(low, normal)
    sum(losses.values()).backward()
    assert gradient(enhancer.decom) == 0
    assert gradient(enhancer.enhance) > 0
    assert losses.keys() == {"brightness", "ssim", "smoothness"}


def test_the_joint_stage_reaches_both_and_keeps_l_decom():
    enhancer, (low, normal) = make_enhancer(), make_pair()
    stage = EnhanceStage(enhancer, RetinexLoss(), train_decom=True, decom_loss=RetinexLoss())
    losses, _ = stage(low, normal)
    assert losses.keys() == {"brightness", "ssim", "smoothness", "reconstruction", "reflectance", "illumination"}
    losses["brightness"].backward(retain_graph=True)
    assert gradient(enhancer.decom) > 0
    low.grad = normal.grad = None
    losses["reflectance"].backward(retain_graph=True)
    assert low.grad.abs().sum() > 0
    assert normal.grad.abs().sum() > 0
