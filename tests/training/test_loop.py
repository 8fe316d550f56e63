"""The training loop: portions, clipping, precision, schedules, and losses that are not finite."""

from pathlib import Path

import pytest
import torch
from tiny_training import Patches, column, make_stage, train, weights
from torch import Tensor

from diffnav.errors import UserError
from diffnav.losses.retinex import RetinexLoss
from diffnav.training.loop import Plan, fit
from diffnav.training.run import Run
from diffnav.training.schedules import Constant, OneCycle
from diffnav.training.stages import DecomStage, DirectStage, EnhanceStage, Stage


@pytest.mark.parametrize("kind", [DecomStage, EnhanceStage, DirectStage])
def test_accumulation_equals_the_big_batch(tmp_path: Path, kind: type[Stage]) -> None:
    """4 steps of 4 samples, whole and in 2 and 4 portions: losses within 1e-5 of each other, relatively.

    SGD, since Adam's division by tiny second moments enlarges differences of rounding.
    """
    for portions in (1, 2, 4):
        train(tmp_path / str(portions), make_stage(kind), torch.optim.SGD, accumulate=portions)
    whole = column(tmp_path / "1", "total")
    assert column(tmp_path / "2", "total") == pytest.approx(whole, rel=1e-5)
    assert column(tmp_path / "4", "total") == pytest.approx(whole, rel=1e-5)
    assert whole[0] != whole[-1]


def test_batch_that_cannot_be_divided_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"training\.batch is 4, which 1 processes x accumulate=3 do not divide"):
        train(tmp_path, accumulate=3)


def test_clip_norm_bounds_the_step(tmp_path: Path) -> None:
    """With SGD the step is rate x gradient, so a gradient of norm 1e-3 moves the weights by 1e-5."""
    before = weights(make_stage())
    free = weights(train(tmp_path / "free", optimiser=torch.optim.SGD, steps=1))
    clipped = weights(train(tmp_path / "clipped", optimiser=torch.optim.SGD, steps=1, clip_norm=1e-3))
    assert (free - before).norm() > 1e-4
    # Weights of about .1 are stored to 1e-8 each.
    assert (clipped - before).norm().item() == pytest.approx(1e-5, rel=0.05)
    direction = torch.cosine_similarity(free - before, clipped - before, dim=0)
    assert direction > 0.99
    loose = weights(train(tmp_path / "loose", optimiser=torch.optim.SGD, steps=1, clip_norm=1e6))
    assert torch.equal(loose, free)


def test_bf16_stays_near_float32_and_losses_are_float32(tmp_path: Path) -> None:
    """bf16 has 8 significant bits: after 4 steps the losses agree to 2 %."""
    for bf16 in (False, True):
        train(tmp_path / str(bf16), make_stage(bf16=bf16))
    exact, rounded = (column(tmp_path / name, "total") for name in ("False", "True"))
    assert rounded == pytest.approx(exact, rel=0.02)
    assert rounded != exact
    low, normal = (torch.rand(1, 3, 16, 16) for _ in range(2))
    for kind in (DecomStage, EnhanceStage, DirectStage):
        stage = make_stage(kind, bf16=True)
        losses, _ = stage(low, normal)
        assert {value.dtype for value in losses.values()} == {torch.float32}
        assert {p.dtype for p in stage.parameters()} == {torch.float32}


def test_learning_rate_follows_the_schedule(tmp_path: Path) -> None:
    train(tmp_path, schedule=OneCycle(warmup=0.5, final=0.5), steps=4)
    assert column(tmp_path, "learning_rate") == pytest.approx([0.005, 0.01, 0.01, 0.005])


def test_frozen_network_stays_and_the_other_moves(tmp_path: Path) -> None:
    for kind, moving, frozen in ((DecomStage, "decom", "enhance"), (EnhanceStage, "enhance", "decom")):
        before, after = (make_stage(kind).enhancer, train(tmp_path / moving, make_stage(kind)).enhancer)
        for name, same in ((frozen, True), (moving, False)):
            pairs = zip(getattr(before, name).parameters(), getattr(after, name).parameters(), strict=True)
            assert all(torch.equal(a, b) for a, b in pairs) is same
    joint = train(tmp_path / "joint", make_stage(EnhanceStage, train_decom=True))
    assert not torch.equal(joint.enhancer.decom.layers[0].weight, make_stage().enhancer.decom.layers[0].weight)


class BadSSIM(RetinexLoss):
    """A loss whose SSIM term is no number from the third call on."""

    calls = 0

    def enhancement(self, *tensors: Tensor) -> dict[str, Tensor]:
        type(self).calls += 1
        losses = super().enhancement(*tensors)
        return losses | {"ssim": losses["ssim"] * (float("nan") if self.calls > 2 else 1)}


def test_loss_that_is_not_finite_is_named_with_step_and_batch(tmp_path: Path) -> None:
    """Step 3 of batches of 4 sees samples 8 to 11; what was saved before stays sound."""
    stage = make_stage()
    stage.loss = BadSSIM()
    with pytest.raises(UserError, match=r"loss 'ssim' became nan at step 3, in the batch of samples 8 to 11"):
        train(tmp_path, stage, save_every=1)
    state = torch.load(tmp_path / "state.pt", weights_only=True)
    assert state["step"] == 2
    assert all(tensor.isfinite().all() for tensor in state["model"].values())


class SteepLoss(RetinexLoss):
    """A loss of 0 whose gradient is infinite."""

    def fidelity(self, enhanced: Tensor, normal: Tensor) -> dict[str, Tensor]:  # noqa: ARG002
        return {"steep": (enhanced - enhanced.detach()).abs().sum().sqrt()}


def test_gradient_that_is_not_finite_never_reaches_the_weights(tmp_path: Path) -> None:
    stage = make_stage(DirectStage)
    stage.loss = SteepLoss()
    with pytest.raises(UserError, match=r"gradient norm became nan at step 1, in the batch of samples 0 to 3"):
        train(tmp_path, stage)
    assert torch.equal(weights(stage), weights(make_stage(DirectStage)))


def test_absurd_rate_ends_in_one_sentence(tmp_path: Path) -> None:
    stage = make_stage()
    optimiser = torch.optim.SGD([p for p in stage.parameters() if p.requires_grad], lr=1e38)
    with pytest.raises(UserError, match=r"lower optimiser\.lr, or set training\.clip_norm"):
        fit(stage, Patches(), optimiser, Constant(), Plan(steps=9, batch=2), Run(tmp_path, {}))


@pytest.mark.parametrize(
    ("setting", "key"),
    [({"steps": 0}, "steps"), ({"batch": 0}, "batch"), ({"workers": -1}, "workers"), ({"clip_norm": 0.0}, "clip_norm")],
)
def test_impossible_plans_are_refused_by_name(setting: dict, key: str) -> None:
    with pytest.raises(UserError, match=rf"training\.{key} must be"):
        Plan(**({"steps": 1} | setting))


def test_workers_change_nothing(tmp_path: Path) -> None:
    for workers in (0, 2):
        train(tmp_path / str(workers), workers=workers)
    assert column(tmp_path / "0", "total") == column(tmp_path / "2", "total")
