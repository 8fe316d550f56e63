"""The fine-tune stage: what it weighs, where its gradient goes, what it remembers, and its command."""

from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from tiny_training import picture, rows
from torch import Tensor

from diffnav.checkpoints import load_enhancer, read_checkpoint, save_enhancer
from diffnav.data.match_pairs.random_views import RandomViews
from diffnav.errors import UserError
from diffnav.images import from_uint8
from diffnav.losses.hybrid import HybridLoss
from diffnav.losses.retinex import RetinexLoss
from diffnav.matching.descriptors.soft_sift import SoftSift
from diffnav.pretrained import pretrained_path
from diffnav.retinex.enhancer import DirectEnhancer, RetinexEnhancer
from diffnav.training.balance import Balance, Curriculum, pulled
from diffnav.training.finetune import FinetuneStage
from diffnav.training.stages import DirectStage, EnhanceStage
from train import finetune

TWO = "training.steps=2"
HYBRID = HybridLoss(w_s=0.5, w_m=0.25, w_d=0.25, w_h=0.1, h_below=100.0, h_ramp=1)


def batch(size: int = 96, count: int = 2) -> dict[str, Tensor]:
    normal = torch.stack([from_uint8(picture(n, size, size)) for n in range(count)])
    views = RandomViews(180.0, (0.9, 1.1), 0.02)
    H = torch.stack([views.draw((size, size), 0, str(n)) for n in range(count)])
    return {"low": normal**3, "normal": normal, "H_view_normal": H, "exposure": torch.linspace(0.9, 1.1, count)}


def stage_of(loss: HybridLoss = HYBRID, direct: bool = False, train_decom: bool = False) -> FinetuneStage:
    torch.manual_seed(0)
    if direct:
        return FinetuneStage(DirectStage(DirectEnhancer(width=4), loss), loss, {"soft_sift": SoftSift()})
    base = EnhanceStage(RetinexEnhancer(width=4), loss, train_decom=train_decom, decom_loss=RetinexLoss())
    return FinetuneStage(base, loss, {"soft_sift": SoftSift()})


def gradient_of(loss: Tensor, stage: FinetuneStage) -> Tensor:
    trained = [p for p in stage.enhancer.parameters() if p.requires_grad]
    found = torch.autograd.grad(loss, trained, retain_graph=True, allow_unused=True)
    return torch.cat([g.flatten() for g in found if g is not None])


def test_each_term_pulls_as_hard_as_its_weight_says(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the first step the running means are this step's norms: w_k |g_paper| at the picture, whatever the values."""
    stage, pair = stage_of(), batch()
    noise = torch.randn(pair["normal"].shape, generator=torch.Generator().manual_seed(0))
    enhanced = (0.9 * pair["normal"] + 0.02 * noise).requires_grad_()
    outcome = enhanced, HYBRID.fidelity(enhanced, pair["normal"]), {}
    monkeypatch.setattr(stage.base, "outcome", lambda *_: outcome)
    losses, _ = stage(**pair)

    def pull(loss: Tensor) -> float:
        return torch.autograd.grad(loss, enhanced, retain_graph=True)[0].norm().item()

    paper = pull(losses["brightness"] + losses["ssim"])
    weights = {"structure": 0.5, "match_soft_sift": 0.25, "detector": 0.25, "homography": 0.1}
    assert set(losses) == {"brightness", "ssim", *weights}
    for name, weight in weights.items():
        assert pull(losses[name]) == pytest.approx(weight * paper, rel=1e-4)


def test_decom_gets_a_gradient_only_where_it_is_trained() -> None:
    for train_decom in (False, True):
        stage = stage_of(train_decom=train_decom)
        losses, _ = stage(**batch())
        losses["match_soft_sift"].backward()
        assert (stage.enhancer.decom.layers[0].weight.grad is not None) == train_decom
        assert stage.enhancer.enhance.last.weight.grad.abs().sum() > 0


def test_the_matcher_alone_has_no_term_of_the_paper() -> None:
    losses, _ = stage_of(HybridLoss(w_p=0, w_s=1))(**batch())
    assert set(losses) == {"structure"}
    losses, _ = stage_of(HybridLoss(w_p=0, w_s=1), train_decom=True)(**batch())
    assert set(losses) == {"structure", "reconstruction", "reflectance", "illumination"}


@pytest.mark.parametrize("value", [0.0, 0.5])
def test_flat_and_black_pictures_give_finite_losses_and_gradients(value: float) -> None:
    stage = stage_of(direct=True)
    flat = {key: torch.full_like(x, value) if key in ("low", "normal") else x for key, x in batch().items()}
    losses, figures = stage(**flat)
    total = torch.stack(list(losses.values())).sum()
    assert torch.isfinite(total)
    assert torch.isfinite(gradient_of(total, stage)).all()
    assert figures["degenerate"] == 1
    assert figures["keypoints"] == 0


class TestCurriculum:
    """The homography term joins when matching has become good enough."""

    def test_it_waits_then_ramps_and_does_not_go_back(self) -> None:
        curriculum = Curriculum(threshold=1.0, ramp=4)
        factors = [curriculum.step(torch.tensor(value)).item() for value in (2.0, 2.0, -60.0, 0.5, 900.0, 900.0, 900.0)]
        assert factors == [0, 0, 0.25, 0.5, 0.75, 1, 1]

    def test_its_state_is_all_of_it(self) -> None:
        first, second = Curriculum(1.0, 10), Curriculum(1.0, 10)
        for _ in range(3):
            first.step(torch.tensor(0.5))
        second.load_state_dict(first.state_dict())
        assert first.step(torch.tensor(0.5)) == second.step(torch.tensor(0.5)) == 0.4


class TestBalance:
    """Shares of gradient."""

    def test_norms_are_running_means(self) -> None:
        balance = Balance(["paper", "other"])
        for slope in (1.0, 3.0):
            picture_ = torch.zeros(4, requires_grad=True)
            balance.pulls({"paper": (slope * picture_).sum()}, picture_)
        assert balance.norm_paper.item() == pytest.approx(0.98 * 2 + 0.02 * 6)

    def test_a_pulled_value_has_that_gradient(self) -> None:
        picture_ = torch.tensor([1.0, 2.0], requires_grad=True)
        gradient = torch.tensor([3.0, -1.0])
        value = pulled(torch.tensor(7.0), gradient, picture_)
        value.backward()
        assert value.item() == 7
        assert torch.equal(picture_.grad, gradient)


def init(tmp_path: Path, direct: bool = False) -> str:
    torch.manual_seed(0)
    network = (DirectEnhancer if direct else RetinexEnhancer)(width=4, padding="zeros")
    save_enhancer(tmp_path / "init.pt", network, "direct" if direct else "joint", {})
    return f"init={tmp_path / 'init.pt'}"


FAST = ("data.patch=64", "validation.matchers=[sift]", "validation.crop=[64,64]")


@pytest.mark.parametrize("loss", ["paper", "matcher", "hybrid", "hybrid_light"])
@pytest.mark.parametrize("mode", ["frozen", "joint", "direct"])
def test_every_loss_runs_in_every_mode(loss: str, mode: str, tiny, tmp_path: Path, door: Callable) -> None:
    settings = {"frozen": [], "joint": ["train_decom=true"], "direct": ["stage=direct"]}[mode]
    door(finetune.main, *tiny, *FAST, TWO, "run=a", f"loss={loss}", init(tmp_path, mode == "direct"), *settings)
    logged = rows(tmp_path / "a" / "metrics.csv")
    assert len(logged) == 2
    assert ("brightness" in logged[0]) == (loss != "matcher")
    assert ("gradient_structure" in logged[0]) == (loss != "paper")
    assert ("raw_homography" in logged[0]) == (loss in ("matcher", "hybrid"))
    assert "correct_sift" in rows(tmp_path / "a" / "validation.csv")[0]
    before, after = (read_checkpoint(tmp_path / name)["weights"] for name in ("init.pt", "a/last.pt"))
    moved = {name.split(".")[0] for name in before if not torch.equal(before[name], after[name])}
    assert moved == ({"enhance"} if mode == "frozen" else {"decom", "enhance"})


def test_the_control_sees_the_same_patches(tiny, tmp_path: Path, door: Callable) -> None:
    """loss=paper and a hybrid loss at its first step differ in nothing that the paper's terms see."""
    first = []
    for loss in ("paper", "hybrid"):
        door(finetune.main, *tiny, *FAST, TWO, f"run={loss}", f"loss={loss}", init(tmp_path))
        first.append({key: rows(tmp_path / loss / "metrics.csv")[0][key] for key in ("brightness", "ssim", "R_mean")})
    assert first[0] == first[1]


def test_a_stopped_run_remembers_norms_and_curriculum(tiny, tmp_path: Path, door: Callable) -> None:
    settings = (*tiny, *FAST, "schedule=constant", "loss.h_below=100", init(tmp_path))
    door(finetune.main, *settings, "training.steps=4", "run=whole")
    for steps in (2, 4):
        door(finetune.main, *settings, f"training.steps={steps}", "run=parts")
    assert rows(tmp_path / "whole" / "metrics.csv") == rows(tmp_path / "parts" / "metrics.csv")


@pytest.mark.parametrize("departure", ["detail=true", "reflectance=exact"])
def test_departures_begin_where_the_checkpoint_stands_and_ship_with_it(
    departure: str, tiny, tmp_path: Path, door: Callable
) -> None:
    door(finetune.main, *tiny, *FAST, TWO, "run=a", init(tmp_path), departure)
    key, value = departure.split("=")
    settings = read_checkpoint(tmp_path / "a")["settings"]
    assert str(settings[key]).lower() == value
    image = torch.rand(1, 3, 30, 41)
    assert load_enhancer(tmp_path / "a")(image).shape == image.shape


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["loss.w_m=-1"], "loss.w_m must be 0 or more"),
        (["loss=matcher", "loss.w_s=0", "loss.w_m=0", "loss.w_d=0", "loss.w_h=0"], "every weight of the loss is 0"),
        (["descriptors=[]"], "name at least one"),
        (["descriptors=[surf]"], "unknown descriptor 'surf'; there are aliked, soft_sift, xfeat"),
        (["views.exposure=[2,1]"], "views.exposure must be two numbers"),
        (["views.rotation_deg=200"], "rotation_deg must be from 0 to 180"),
        (["reflectance=none"], "reflectance must be network or exact"),
        (["validation.matchers=[none]"], "unknown matcher 'none'"),
        (["loss.keypoints=3"], "loss.keypoints must be 8 or more"),
    ],
)
def test_mistakes_are_one_sentence(arguments: list[str], words: str, tiny, refusal, tmp_path: Path) -> None:
    assert words in refusal(finetune.main, *tiny, *FAST, TWO, "run=a", init(tmp_path), *arguments)


@pytest.mark.parametrize("name", ["xfeat", "aliked"])
def test_a_learned_matcher_in_the_loss(name: str, tiny, tmp_path: Path, door: Callable) -> None:
    try:
        pretrained_path({"xfeat": "xfeat/xfeat_backbone_from_onnx.pt", "aliked": "aliked/aliked-n16.pth"}[name], "")
    except UserError as error:
        pytest.skip(f"published weights are not here: {error}")
    door(finetune.main, *tiny, *FAST, TWO, "run=a", f"descriptors=[soft_sift,{name}]", init(tmp_path))
    logged = rows(tmp_path / "a" / "metrics.csv")[-1]
    assert float(logged[f"gradient_match_{name}"]) > 0
    assert float(logged[f"match_{name}"]) > 0
    # Frozen, and no part of what is saved.
    assert not [key for key in read_checkpoint(tmp_path / "a")["weights"] if name in key]


def test_a_homography_needs_what_follows_turns(tiny, tmp_path: Path, refusal) -> None:
    try:
        pretrained_path("xfeat/xfeat_backbone_from_onnx.pt", "")
    except UserError as error:
        pytest.skip(f"published weights are not here: {error}")
    words = refusal(finetune.main, *tiny, *FAST, TWO, "run=a", "descriptors=[xfeat]", init(tmp_path))
    assert "loss.w_h needs a descriptor that follows turns, beside xfeat" in words
