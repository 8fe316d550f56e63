"""Zero-DCE's losses: beside slow loops, by hand, and their gradients where they are 0."""

import math

import numpy as np
import pytest
import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.losses.zero_dce import ZeroDceLoss, colour_constancy, curve_variation, exposure, spatial_consistency


def random_images(count: int = 1, *size: int) -> list[Tensor]:
    dice = torch.Generator().manual_seed(5)
    return [torch.rand(*size, generator=dice, dtype=torch.float64) for _ in range(count)]


def region_means(image: np.ndarray, region: int) -> np.ndarray:
    """(h, w) of one picture (3, H, W): means over channels and region x region pixels; what is left over is cut off."""
    rows, columns = image.shape[1] // region, image.shape[2] // region
    means = np.zeros((rows, columns))
    for row in range(rows):
        for column in range(columns):
            part = image[:, row * region : (row + 1) * region, column * region : (column + 1) * region]
            means[row, column] = sum(part.flatten()) / part.size
    return means


def test_spatial_consistency_beside_loops() -> None:
    low, enhanced = random_images(2, 2, 3, 14, 21)
    total, count = 0.0, 0
    for one_low, one_enhanced in zip(low.numpy(), enhanced.numpy(), strict=True):
        I, Y = region_means(one_low, 4), region_means(one_enhanced, 4)
        for row in range(3):
            for column in range(5):
                count += 1
                for dy, dx in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                    y, x = row + dy, column + dx
                    if 0 <= y < 3 and 0 <= x < 5:
                        total += ((Y[row, column] - Y[y, x]) - (I[row, column] - I[y, x])) ** 2
    assert spatial_consistency(enhanced, low).item() == pytest.approx(total / count)


def test_spatial_consistency_ignores_an_equal_gain_in_brightness() -> None:
    (low,) = random_images(1, 1, 3, 16, 16)
    assert spatial_consistency(low + 0.3, low).item() == pytest.approx(0, abs=1e-12)
    assert spatial_consistency(2 * low, low).item() > 1e-4


def test_exposure_beside_loops() -> None:
    (image,) = random_images(1, 2, 3, 37, 50)
    squares = [(mean - 0.6) ** 2 for one in image.numpy() for mean in region_means(one, 16).flatten()]
    assert len(squares) == 2 * 2 * 3
    assert exposure(image).item() == pytest.approx(sum(squares) / len(squares))
    assert exposure(torch.full((1, 3, 16, 16), 0.2), level=0.5).item() == pytest.approx(0.09, abs=1e-6)


def test_colour_constancy_by_hand() -> None:
    """Means .5, .3, .4 and a grey picture: sqrt(.2^4 + .1^4 + .1^4) / 2."""
    image = torch.tensor([[0.5, 0.3, 0.4], [0.2, 0.2, 0.2]], dtype=torch.float64)[:, :, None, None].expand(2, 3, 2, 2)
    texture = torch.tensor([[0.1, -0.1], [-0.1, 0.1]], dtype=torch.float64)
    expected = math.sqrt(0.2**4 + 2 * 0.1**4) / 2
    assert colour_constancy(image + texture).item() == pytest.approx(expected)
    assert colour_constancy(image[:, [2, 0, 1]]).item() == pytest.approx(expected)


def test_curve_variation_beside_loops() -> None:
    (curves,) = random_images(1, 2, 24, 4, 6)
    total = 0.0
    for one in curves.numpy():
        for channel in one:
            down = [(channel[y + 1, x] - channel[y, x]) ** 2 for y in range(3) for x in range(6)]
            across = [(channel[y, x + 1] - channel[y, x]) ** 2 for y in range(4) for x in range(5)]
            total += 2 * (sum(down) / len(down) + sum(across) / len(across))
    assert curve_variation(curves).item() == pytest.approx(total / 2)
    assert curve_variation(torch.full((1, 24, 5, 5), 0.7)).item() == 0


def test_gradients_are_right() -> None:
    low, enhanced, curves = random_images(3, 1, 3, 16, 16)
    curves = (curves[:, :, :4, :4] - 0.5).requires_grad_()
    enhanced.requires_grad_()
    assert torch.autograd.gradcheck(lambda e: spatial_consistency(e, low), enhanced)
    assert torch.autograd.gradcheck(exposure, enhanced)
    assert torch.autograd.gradcheck(colour_constancy, enhanced)
    assert torch.autograd.gradcheck(curve_variation, curves)


@pytest.mark.parametrize("value", [0.0, 0.6, 1.0])
def test_gradients_are_finite_where_nothing_is_wrong(value: float) -> None:
    """Grey, flat, well exposed: the colour term's root stands at 0."""
    image = torch.full((1, 3, 32, 32), value, requires_grad=True)
    curves = torch.zeros(1, 24, 32, 32, requires_grad=True)
    sum(ZeroDceLoss()(image.detach(), image, curves).values()).backward()
    assert image.grad is not None
    assert image.grad.isfinite().all()
    assert curves.grad is not None
    assert curves.grad.abs().max() == 0


def test_the_terms_carry_their_weights() -> None:
    low, enhanced, curves = random_images(3, 2, 3, 32, 32)
    terms = ZeroDceLoss(spatial=2.0, exposure=3.0, colour=4.0, variation=5.0, level=0.4)(low, enhanced, curves)
    expected = {
        "spatial": 2 * spatial_consistency(enhanced, low),
        "exposure": 3 * exposure(enhanced, 0.4),
        "colour": 4 * colour_constancy(enhanced),
        "variation": 5 * curve_variation(curves),
    }
    assert list(terms) == list(expected)
    for name, value in expected.items():
        assert terms[name].item() == pytest.approx(value.item()), name


@pytest.mark.parametrize("settings", [{"spatial": -1.0}, {"variation": -0.1}, {"level": 0.0}, {"level": 1.0}])
def test_impossible_settings_are_one_sentence(settings: dict[str, float]) -> None:
    with pytest.raises(UserError, match=f"baseline.loss.{next(iter(settings))} must"):
        ZeroDceLoss(**settings)
