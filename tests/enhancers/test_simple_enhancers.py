"""input, normal, gamma_blind, gamma_oracle, clahe; and what every enhancer of conf/enhancer must keep to."""

import inspect
import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
import torch
from hydra.errors import InstantiationException
from hydra.utils import get_object, instantiate
from torch import Tensor

from conf.command import choice, choices
from diffnav.darkness import Darkening, DarknessModel, apply_gamma, darken
from diffnav.enhancers.clahe import Clahe
from diffnav.enhancers.gamma_blind import GammaBlind
from diffnav.enhancers.gamma_oracle import GammaOracle
from diffnav.enhancers.input import Input
from diffnav.enhancers.normal import Normal
from diffnav.enhancers.visible import Visible
from diffnav.errors import UserError


def daylight(batch: int = 2, size: tuple[int, int] = (24, 40)) -> Tensor:
    """Smooth colourful pictures."""
    y, x = torch.meshgrid(torch.linspace(0, 1, size[0]), torch.linspace(0, 1, size[1]), indexing="ij")
    waves = [0.5 + 0.4 * torch.sin(7 * x + k) * torch.cos(5 * y + 2 * k) for k in range(3 * batch)]
    return torch.stack(waves).reshape(batch, 3, *size)


def darkened(normal: Tensor) -> tuple[Tensor, list[Darkening]]:
    model = DarknessModel()
    records = [replace(model.draw(one.max().item(), seed), normal=one) for seed, one in enumerate(normal)]
    return torch.stack([darken(one, record) for one, record in zip(normal, records, strict=True)]), records


@pytest.mark.parametrize("name", choices("enhancer"))
def test_every_enhancer_keeps_shape_range_and_argument(name: str) -> None:
    try:
        enhancer = instantiate(choice("enhancer", name)).eval()
    except InstantiationException as error:
        if "no weights file" in str(error):
            pytest.skip(f"the published weights of {name} are not here")
        raise
    low, records = darkened(daylight(2, (40, 56)))
    before = low.clone()
    with torch.no_grad():
        result = enhancer(low, records)
    assert result.shape == low.shape
    assert result.dtype == torch.float32
    assert result.min() >= 0
    assert result.max() <= 1
    assert torch.equal(low, before)


@pytest.mark.parametrize("name", choices("enhancer"))
def test_a_yaml_holds_every_argument(name: str) -> None:
    """Its defaults are written out, so that settings are found and a hash of them says all."""
    cfg = choice("enhancer", name)
    parameters = inspect.signature(get_object(cfg["_target_"])).parameters.values()
    names = {p.name for p in parameters if p.kind is p.POSITIONAL_OR_KEYWORD}
    # Where it runs is the command's setting, not the enhancer's.
    assert names - {"device"} == set(cfg) - {"_target_"}


def test_input_changes_nothing() -> None:
    low, _ = darkened(daylight())
    assert torch.equal(Input()(low), low)


def test_normal_gives_the_daylight_pictures() -> None:
    normal = daylight()
    low, records = darkened(normal)
    assert torch.equal(Normal()(low, records), normal)


def test_gamma_blind_is_the_root_of_every_value() -> None:
    low = torch.tensor([0.0, 1 / 255, 16 / 255, 0.5, 1.0]).expand(1, 3, 1, 5)
    expected = [0.0, (1 / 255) ** 0.25, (16 / 255) ** 0.25, math.sqrt(math.sqrt(0.5)), 1.0]
    assert GammaBlind(4.0)(low)[0, 1, 0].tolist() == pytest.approx(expected, abs=1e-6)
    assert GammaBlind(2.0)(low)[0, 1, 0, 3].item() == pytest.approx(math.sqrt(0.5))


def test_gamma_oracle_inverts_each_picture_by_its_own_record() -> None:
    """Without 8 bit and JPEG in between, Eq. 9 comes back exactly, whatever gamma and maximum."""
    normal = daylight()
    normal[1] *= 0.7
    records = [Darkening(gamma, one.max().item()) for gamma, one in zip((3.2, 4.9), normal, strict=True)]
    low = torch.stack([apply_gamma(one, record) for one, record in zip(normal, records, strict=True)])
    assert torch.allclose(GammaOracle()(low, records), normal, atol=1e-4)
    swapped = GammaOracle()(low, records[::-1])
    assert not torch.allclose(swapped, normal, atol=0.05)


def test_gamma_oracle_by_hand() -> None:
    """PAPER 3: maximum 200, I = 128, gamma 4 gives 33.55."""
    low = torch.full((1, 3, 1, 1), 33.5544 / 255)
    assert 255 * GammaOracle()(low, [Darkening(4.0, 200 / 255)])[0, 0, 0, 0].item() == pytest.approx(128, abs=0.01)


@pytest.mark.parametrize("enhancer", [Normal(), GammaOracle()])
@pytest.mark.parametrize("records", [None, [], [None, None], [Darkening(4.0, 1.0)]])
def test_a_missing_record_is_one_sentence(enhancer: torch.nn.Module, records: list | None) -> None:
    with pytest.raises(UserError, match="needs the record"):
        enhancer(daylight(2), records)


def test_normal_without_its_picture_is_one_sentence() -> None:
    for picture in (None, torch.zeros(3, 5, 5)):
        with pytest.raises(UserError, match="daylight picture"):
            Normal()(daylight(1), [Darkening(4.0, 1.0, normal=picture)])


def test_clahe_of_lightness_leaves_colour() -> None:
    """In CIELAB, a and b are those of the input and L is OpenCV's CLAHE of its 8-bit levels."""
    image = 0.2 + 0.3 * daylight(1)
    result = Clahe(clip_limit=3.0, grid=4)(image)
    before, after = (
        cv2.cvtColor(np.ascontiguousarray(one[0].permute(1, 2, 0).numpy()), cv2.COLOR_RGB2LAB)
        for one in (image, result)
    )
    inside = ((result[0] > 0) & (result[0] < 1)).all(0).numpy()
    assert inside.mean() > 0.8
    # OpenCV interpolates its float CIELAB from tables: a round trip costs up to .3 of 100.
    assert np.abs(after - before)[inside][:, 1:].max() < 0.5
    levels = (before[..., 0] * 2.55).round().astype(np.uint8)
    expected = cv2.createCLAHE(3.0, (4, 4)).apply(levels) / 2.55
    assert np.abs(after[..., 0] - expected)[inside].max() < 0.5
    assert after[..., 0].std() > 1.3 * before[..., 0].std()


def test_clahe_of_the_value_keeps_the_ratios_of_channels() -> None:
    image = 0.1 + 0.3 * daylight(1)
    result = Clahe(channel="V")(image)[0]
    inside = (result.max(0).values > 0.05) & (result.max(0).values < 1)
    before, after = (one / one.max(0).values for one in (image[0], result))
    assert torch.allclose(before[:, inside], after[:, inside], atol=1e-4)
    assert result.std() > image.std()


def test_clahe_does_not_mix_the_pictures_of_a_batch() -> None:
    image = daylight(2)
    assert torch.equal(Clahe()(image)[1:], Clahe()(image[1:]))


@pytest.mark.parametrize(
    ("enhancer", "arguments"), [(Clahe, {"clip_limit": 0}), (Clahe, {"channel": "S"}), (GammaBlind, {"gamma": 0})]
)
def test_impossible_settings_are_one_sentence(enhancer: type, arguments: dict) -> None:
    with pytest.raises(UserError):
        enhancer(**arguments)


def test_visible_is_daylight_where_levels_are_left_and_flat_elsewhere() -> None:
    normal = daylight(1)
    record = Darkening(gamma=4.0, maximum=1.0, quality=95, normal=normal[0])
    result = Visible(levels=2)(normal**4, [record])
    for channel, shown in zip(normal[0].tolist(), result[0].tolist(), strict=True):
        # 2.5 / 255 is the darkest that rounds to level 3.
        lost = [value for row in channel for value in row if value**4 * 255 < 2.5]
        for row, shown_row in zip(channel, shown, strict=True):
            for value, other in zip(row, shown_row, strict=True):
                expected = sum(lost) / len(lost) if value**4 * 255 < 2.5 else value
                assert other == pytest.approx(expected, abs=1e-5)
    assert (result == normal).float().mean() > 0.1
    assert (result != normal).float().mean() > 0.1


def test_visible_refuses_levels_that_eight_bits_do_not_have() -> None:
    with pytest.raises(UserError, match="levels from 0 to 254"):
        Visible(255)
