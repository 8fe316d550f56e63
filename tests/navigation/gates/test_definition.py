"""Eq. 10: the paper's hand-made values, the definition in plain loops, and what it must not depend on."""

import pytest
import torch

from diffnav.navigation.gates.definition import definition, laplacian


def picture(height=7, width=9, seed=0):
    return torch.rand(3, height, width, generator=torch.Generator().manual_seed(seed))


@pytest.mark.parametrize("v", [1, 100, 255])
def test_one_pixel_on_black_sums_to_eight_times_its_value(v):
    image = torch.zeros(3, 9, 11)
    image[:, 4, 6] = v / 255
    assert definition(image, literal_sum=True).item() == pytest.approx(8 * v, rel=1e-5)
    assert definition(image).item() == pytest.approx(8 * v / 99, rel=1e-5)


def test_a_constant_picture_has_none_up_to_its_border():
    image = torch.tensor([0.2, 0.5, 0.9])[:, None, None].expand(3, 6, 8)
    assert laplacian(image).abs().max() < 1e-4


def test_a_ramp_has_none_but_at_the_border():
    ramp = torch.linspace(0, 9 / 255, 10).expand(3, 5, 10)
    # Replicated, the first and the last column differ by one level from one neighbour.
    assert definition(ramp, literal_sum=True).item() == pytest.approx(2 * 5, rel=1e-3)


def test_the_formula_in_plain_loops():
    image = picture()
    _, height, width = image.shape
    grey = [
        [255 * sum(w * image[c, y, x].item() for c, w in enumerate((0.299, 0.587, 0.114))) for x in range(width)]
        for y in range(height)
    ]
    total = 0.0
    for y in range(height):
        for x in range(width):
            around = 0.0
            for dy, dx in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                around += grey[min(max(y + dy, 0), height - 1)][min(max(x + dx, 0), width - 1)]
            total += abs(around - 4 * grey[y][x])
    assert definition(image, literal_sum=True).item() == pytest.approx(total, rel=1e-5)
    assert definition(image).item() == pytest.approx(total / (height * width), rel=1e-5)


def test_a_batch_gives_one_number_a_picture():
    images = torch.stack([picture(seed=1), picture(seed=2)])
    expected = [definition(image).item() for image in images]
    assert definition(images).tolist() == pytest.approx(expected)
    assert laplacian(images).shape == (2, 7, 9)


def test_the_mean_does_not_grow_with_the_picture():
    small = picture(8, 8)
    large = torch.cat([torch.cat([small, small.flip(2)], 2), torch.cat([small, small.flip(2)], 2).flip(1)], 1)
    # Mirrored copies continue as the replicated border does.
    assert definition(large).item() == pytest.approx(definition(small).item(), rel=1e-5)
    assert definition(large, literal_sum=True).item() == pytest.approx(4 * definition(small, True).item(), rel=1e-5)


def test_one_pixel_is_a_picture():
    assert definition(torch.full((3, 1, 1), 0.4)).item() == pytest.approx(0, abs=1e-4)


@pytest.mark.parametrize("shape", [(5, 5), (1, 5, 5), (2, 1, 5, 5), (1, 2, 3, 5, 5)])
def test_other_shapes_are_refused(shape):
    with pytest.raises(ValueError, match="need a picture"):
        definition(torch.zeros(shape))
