"""Correlation of gradient directions: against slow loops, and what a season may change."""

import math

import pytest
import torch
from made_noise import noise
from torch import Tensor

from diffnav.navigation.correlation import Searched, direction_field, highest_peak


def edge(degrees: float, size: int = 61, width: float = 3.0) -> Tensor:
    """A soft edge through the middle whose gradient points to an angle from x towards y (down), (3, h, w)."""
    y, x = torch.meshgrid(*(torch.arange(size).float() - size // 2 for _ in range(2)), indexing="ij")
    along = x * math.cos(math.radians(degrees)) + y * math.sin(math.radians(degrees))
    return torch.sigmoid(along / width).expand(3, -1, -1)


@pytest.mark.parametrize("degrees", [0, 30, 90, 135, 180, 250])
def test_an_edge_becomes_a_vector_at_twice_its_angle(degrees: float) -> None:
    vector = direction_field(edge(degrees))[:, 30, 30]
    length = float(vector.norm())
    assert 1 < length <= 2 + 1e-5
    expected = [math.cos(math.radians(2 * degrees)), math.sin(math.radians(2 * degrees))]
    assert (vector / length).tolist() == pytest.approx(expected, abs=0.02)


def test_seasons_exchange_dark_and_bright() -> None:
    image = noise((80, 100), 1)
    assert torch.allclose(direction_field(1 - image), direction_field(image), atol=2e-3)
    # A gain of a half and an offset: only the floor of what is noise tells them apart.
    fainter = direction_field(0.5 * image + 0.2)
    assert (fainter * direction_field(image)).sum() / (fainter.norm() * direction_field(image).norm()) > 0.999


def test_strong_and_weak_parts_of_a_picture_count_alike() -> None:
    """One half in the shadow of a cloud, a third as bright: its vectors are nearly as long."""
    image = 0.5 + noise((80, 160), 1) / 2
    shaded = image * torch.where(torch.arange(160) < 80, 1 / 3, 1.0)
    lengths = direction_field(shaded).norm(dim=0)
    left, right = lengths[:, 10:65].mean(), lengths[:, 95:150].mean()
    assert 0.65 < left / right < 1
    assert lengths.max() <= 2 + 1e-5


def test_flat_ground_has_no_direction() -> None:
    assert direction_field(torch.full((3, 40, 50), 0.3)).abs().max() < 1e-3
    assert (
        direction_field(torch.rand(3, 40, 50, generator=torch.Generator().manual_seed(0)) / 2000).norm(dim=0).mean()
        < 0.2
    )


def slow_map(template: Tensor, mask: Tensor, picture: Tensor) -> Tensor:
    """The cosine under the mask, place by place."""
    height, width = template.shape[1:]
    rows = []
    for y in range(picture.shape[1] - height + 1):
        row = []
        for x in range(picture.shape[2] - width + 1):
            part = picture[:, y : y + height, x : x + width][:, mask]
            own = template[:, mask]
            row.append(float((part * own).sum() / (part.norm() * own.norm())))
        rows.append(row)
    return torch.tensor(rows)


@pytest.mark.parametrize(("size", "place"), [((24, 31), (9, 20)), ((7, 9), (0, 0)), ((40, 50), (3, 5))])
def test_the_map_is_the_cosine_under_the_mask(size: tuple[int, int], place: tuple[int, int]) -> None:
    dice = torch.Generator().manual_seed(3)
    picture = torch.randn(2, 43, 55, generator=dice)
    mask = torch.rand(size, generator=dice) < 0.7
    y, x = place
    template = picture[:, y : y + size[0], x : x + size[1]] + 0.3 * torch.randn(2, *size, generator=dice)
    scores = Searched(picture).scores(template, mask)
    assert scores.shape == (43 - size[0] + 1, 55 - size[1] + 1)
    assert torch.allclose(scores, slow_map(template, mask, picture), atol=1e-4)
    peak = highest_peak(scores, 3)
    assert (round(peak.x), round(peak.y)) == (x, y)
    # What the mask hides does not count.
    template[:, ~mask] = 9.0
    assert torch.allclose(Searched(picture).scores(template, mask), scores, atol=1e-4)


def test_a_piece_of_a_picture_is_found_where_it_was_cut() -> None:
    field = direction_field(noise((120, 150), 5))
    mask = torch.zeros(50, 60, dtype=torch.bool)
    mask[5:45, 8:52] = True
    scores = Searched(field).scores(field[:, 40:90, 70:130], mask)
    peak = highest_peak(scores, 12)
    assert (peak.x, peak.y) == pytest.approx((70, 40), abs=0.05)
    assert peak.score == pytest.approx(1, abs=1e-3)
    assert peak.rival < 0.5
    assert scores.max() <= 1 + 1e-4


def test_where_nothing_is_shown_nothing_fits() -> None:
    """A map that ends: beyond it all is zero, and what rounding leaves there must not win."""
    field = direction_field(noise((120, 150), 5))
    template, everything = field[:, 10:40, 10:50].clone(), torch.ones(30, 40, dtype=torch.bool)
    for end in (60, 30):
        cut = field.clone()
        cut[:, :, end:] = 0
        cut[:, end:] = 0
        scores = Searched(cut).scores(template, everything)
        assert (scores.abs() <= 1 + 1e-4).all()
        assert scores[end:].abs().max() < 1e-3
        assert scores[:, end:].abs().max() < 1e-3
        if end == 60:
            assert highest_peak(scores, 5)[:3] == pytest.approx((10, 10, 1), abs=0.02)
    assert Searched(0 * field).scores(template, everything).abs().max() == 0
    assert Searched(field).scores(0 * template, everything).abs().max() == 0


def test_a_template_larger_than_the_picture_is_an_error() -> None:
    with pytest.raises(ValueError, match="a template of 20 x 51 pixels is larger than the picture of 30 x 50"):
        Searched(torch.ones(2, 30, 50)).scores(torch.ones(2, 20, 51), torch.ones(20, 51, dtype=torch.bool))


def test_almost_flat_ground_does_not_win() -> None:
    """A faint copy of the template scores as low as its energy says, not 1 as the cosine would."""
    dice = torch.Generator().manual_seed(6)
    picture = torch.randn(2, 60, 90, generator=dice)
    template = torch.randn(2, 20, 20, generator=dice)
    picture[:, 20:50, 40:80] = 0
    picture[:, 25:45, 50:70] = 0.05 * template
    scores = Searched(picture).scores(template, torch.ones(20, 20, dtype=torch.bool))
    # Half of the usual norm, which is that of 800 normal numbers, against .05 of it.
    assert scores[25, 50] == pytest.approx(0.1, abs=0.02)


def bump(x: float, y: float, height: float, curve: float, size: tuple[int, int] = (40, 60)) -> Tensor:
    """A paraboloid."""
    rows, columns = torch.meshgrid(*(torch.arange(side).double() for side in size), indexing="ij")
    return height - curve * ((columns - x) ** 2 + 2 * (rows - y) ** 2)


@pytest.mark.parametrize(("x", "y"), [(20.0, 10.0), (20.3, 9.6), (19.51, 10.49), (40.25, 30.75)])
def test_the_peak_between_pixels_is_exact_for_a_paraboloid(x: float, y: float) -> None:
    peak = highest_peak(bump(x, y, 0.9, 1e-3).clamp(min=-0.9), 5)
    assert (peak.x, peak.y) == pytest.approx((x, y), abs=1e-9)
    assert peak.score == pytest.approx(0.9, abs=1e-3)


def test_at_an_edge_the_peak_is_its_pixel() -> None:
    peak = highest_peak(bump(0.3, 10.4, 0.9, 1e-3), 5)
    assert (peak.x, peak.y) == pytest.approx((0, 10.4), abs=1e-9)


def test_the_highest_that_is_allowed_has_all_others_for_rivals() -> None:
    """Two peaks, at (20, 10) and (45, 30); the higher one is not allowed, or cut through by what is."""
    scores = torch.maximum(bump(20, 10, 0.9, 2e-3), bump(45.2, 30, 0.6, 1e-3))
    columns = torch.arange(60).expand(40, -1)
    second = highest_peak(scores, 5, columns > 35)
    assert (second.x, second.y, second.score, second.rival) == pytest.approx((45.2, 30, 0.6, 0.9), abs=1e-4)
    first = highest_peak(scores, 5, columns < 35)
    assert (first.x, first.y, first.score, first.rival) == pytest.approx((20, 10, 0.9, 0.6), abs=1e-4)
    # Three pixels beside the peak, on its slope: nearer than a rival otherwise is.
    slope = highest_peak(scores, 5, (columns > 22) & (columns < 30))
    assert (slope.x, slope.y) == pytest.approx((23, 10), abs=0.5)
    assert (slope.score, slope.rival) == pytest.approx((0.9 - 9 * 2e-3, 0.9), abs=1e-4)


@pytest.mark.parametrize("away", [(6, 0), (0, -6), (6, 6), (30, 20)])
@pytest.mark.parametrize("near", [(5, -5), (-5, 2), (3, -2)])
def test_the_rival_lies_apart(away: tuple[int, int], near: tuple[int, int]) -> None:
    """A high peak within five pixels along both axes is the same place; a lower one beyond is the rival."""
    scores = torch.full((40, 60), -0.5)
    scores[12, 20] = 0.9
    scores[12 + near[1], 20 + near[0]] = 0.8
    scores[12 + away[1], 20 + away[0]] = 0.4
    peak = highest_peak(scores, 5)
    assert (peak.x, peak.y, peak.score) == (20, 12, pytest.approx(0.9))
    assert peak.rival == pytest.approx(0.4)


def test_the_slope_of_a_wide_peak_is_no_rival() -> None:
    """At 6 pixels it still has .9 - .036; the only other peak is at .3."""
    scores = torch.maximum(bump(20, 10, 0.9, 1e-3), bump(50, 30, 0.3, 1e-3))
    assert highest_peak(scores, 5).rival == pytest.approx(0.3)
    alone = highest_peak(bump(20, 10, 0.9, 1e-3), 5)
    assert alone.rival <= -1
