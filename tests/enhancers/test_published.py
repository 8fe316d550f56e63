"""Networks with published weights: real where the files are found, one sentence where they are not."""

import re
from pathlib import Path

import pytest
import torch
from hydra.errors import InstantiationException
from hydra.utils import instantiate
from torch import Tensor, nn

from conf.command import choice, choices
from diffnav.enhancers.published.sci import PublishedSci
from diffnav.enhancers.published.zero_dce_pp import PublishedZeroDcePp
from diffnav.errors import UserError
from diffnav.images import read_image
from diffnav.pretrained import pretrained_path
from diffnav.scores import psnr

LOL = Path("../shared/data/lowlight/lol_eval15")
PUBLISHED = [name for name in choices("enhancer") if name.startswith("published_")]
# PSNR over the 15 pairs of LOL's eval15, dB, measured with the authors' own code.
KNOWN_DB = [
    ("published_zero_dce_pp", {}, 15.37),
    ("published_sgz", {}, 16.06),
    ("published_sci", {"variant": "easy"}, 9.65),
    ("published_sci", {"variant": "medium"}, 14.86),
    ("published_sci", {"variant": "difficult"}, 13.89),
]
SLOW_DB = [("published_zero_dce", {}, 14.89), ("published_retinexnet", {}, 17.70)]


def build(name: str, settings: dict | None = None) -> nn.Module:
    try:
        pretrained_path("zero-dce/Epoch99.pth", "")
    except UserError as error:
        pytest.skip(f"published weights are not here: {error}")
    return instantiate(choice("enhancer", name, settings))


@torch.no_grad()
def mean_psnr(enhancer: nn.Module) -> float:
    if not LOL.is_dir():
        pytest.skip(f"{LOL} is not here")
    scores = []
    for path in sorted((LOL / "low").iterdir()):
        low, high = read_image(path)[None], read_image(LOL / "high" / f"{path.stem}.jpg")[None]
        scores.append(psnr(enhancer(low), high).item())
    assert len(scores) == 15
    return sum(scores) / 15


def test_all_five_are_here() -> None:
    names = ("zero_dce", "zero_dce_pp", "sgz", "sci", "retinexnet")
    assert {f"published_{name}" for name in names} == set(PUBLISHED)


@pytest.mark.parametrize(("name", "settings", "expected"), KNOWN_DB)
def test_scores_are_those_of_the_authors_code(name: str, settings: dict, expected: float) -> None:
    assert mean_psnr(build(name, settings)) == pytest.approx(expected, abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "settings", "expected"), SLOW_DB)
def test_slow_scores_are_those_of_the_authors_code(name: str, settings: dict, expected: float) -> None:
    assert mean_psnr(build(name, settings)) == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize("name", PUBLISHED)
@pytest.mark.parametrize("size", [(16, 16), (33, 47)])
def test_any_size_and_a_batch_one_by_one(name: str, size: tuple[int, int]) -> None:
    enhancer = build(name)
    dark = 0.2 * torch.rand(2, 3, *size, generator=torch.Generator().manual_seed(0))
    extremes = torch.stack([torch.zeros(3, *size), torch.ones(3, *size)])

    def enhance(image: Tensor) -> Tensor:
        with torch.no_grad():
            return enhancer(image)

    result = enhance(dark)
    assert result.shape == dark.shape
    assert result.mean() > dark.mean()
    torch.testing.assert_close(result, torch.cat([enhance(one[None]) for one in dark]), atol=1e-5, rtol=0)
    assert enhance(extremes).isfinite().all()


@pytest.mark.parametrize("name", PUBLISHED)
def test_nothing_is_trained_and_the_file_is_known(name: str) -> None:
    enhancer = build(name)
    assert not enhancer.training
    assert not any(parameter.requires_grad for parameter in enhancer.parameters())
    assert len(enhancer.sha256) >= 64


def test_zero_dce_pp_is_made_of_separable_convolutions() -> None:
    """10,561 parameters, as the article counts."""
    enhancer = build("published_zero_dce_pp")
    assert isinstance(enhancer, PublishedZeroDcePp)
    assert sum(parameter.numel() for parameter in enhancer.parameters()) == 10_561


@pytest.mark.parametrize("name", PUBLISHED)
def test_missing_weights_are_one_sentence(name: str, tmp_path: Path) -> None:
    settings = choice("enhancer", name, {"folder": str(tmp_path)})
    with pytest.raises(Exception, match=rf"no weights file {tmp_path}/[^\n]+ github\.com/"):
        instantiate(settings)


def test_an_unknown_variant_is_one_sentence() -> None:
    with pytest.raises(UserError, match="variant must be easy, medium or difficult, got 'hard'"):
        PublishedSci("hard")  # type: ignore[arg-type]


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_file_with_other_layers_is_one_sentence(name: str, tmp_path: Path) -> None:
    files = ["zero-dce/Epoch99.pth", "zero-dce++/Epoch99.pth", "sgz/Epoch99.pth", "sci/medium.pt"]
    for file in [*files, "retinexnet/Decom/9200.tar", "retinexnet/Relight/9200.tar"]:
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        torch.save({"enhance.other.weight": torch.ones(2)}, tmp_path / file)
    with pytest.raises(InstantiationException) as caught:
        instantiate(choice("enhancer", name, {"folder": str(tmp_path)}))
    error = caught.value.__cause__
    assert isinstance(error, UserError)
    sentence = rf"{re.escape(str(tmp_path))}[^\n]*: not the weights of this network .*; replace it"
    assert re.fullmatch(sentence, str(error))
