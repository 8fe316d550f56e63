import cv2
import numpy as np
import pytest
import torch
from matcher_checks import check_configuration, check_features, check_half_a_turn, check_nothing

from diffnav.errors import UserError
from diffnav.matching.hamming import two_nearest_hamming
from diffnav.matching.nearest import nearest_neighbours
from diffnav.matching.orb import Orb, centre_px, level_scales, orb_features


def differing_bits(a, b):
    return sum((p ^ q).bit_count() for p, q in zip(a, b, strict=True))


def binary(rows):
    return torch.tensor(rows, dtype=torch.uint8)


def test_the_two_nearest_by_counting_bits():
    a, b = torch.randint(0, 256, (2, 30, 5), dtype=torch.uint8, generator=torch.Generator().manual_seed(2))
    b[:10] ^= 1
    nearest, first, second = two_nearest_hamming(a, b)
    for i, row in enumerate(a.tolist()):
        order = sorted((differing_bits(row, other), j) for j, other in enumerate(b.tolist()))
        assert (first[i].item(), nearest[i].item()) == order[0]
        assert second[i].item() == order[1][0]
    assert first.dtype == second.dtype == torch.float32


def test_of_equally_near_ones_the_first_is_taken():
    nearest, first, second = two_nearest_hamming(binary([[0]]), binary([[3], [1], [2], [4]]))
    assert (nearest.item(), first.item(), second.item()) == (1, 1, 1)


def test_one_candidate_has_no_second():
    nearest, first, second = two_nearest_hamming(binary([[7], [0]]), binary([[1]]))
    assert nearest.tolist() == [0, 0]
    assert first.tolist() == [2, 1]
    assert second.tolist() == [torch.inf, torch.inf]


def test_ratio_test_and_mutual_check_by_hand():
    a = binary([[0b0000, 0], [0b1111, 255], [0b0001, 0]])
    b = binary([[0b0000, 0], [0b1111, 0b11111100], [0b111, 0b11110000]])
    # a0 -> b0 (0 bits, next 7); a1 -> b1 (2, next 5); a2 -> b0 (1, next 6), but b0's nearest is a0.
    assert nearest_neighbours(a, b, ratio=1, mutual=False)[0].tolist() == [[0, 0], [1, 1], [2, 0]]
    indices, confidence = nearest_neighbours(a, b, ratio=0.5, mutual=True)
    assert indices.tolist() == [[0, 0], [1, 1]]
    assert confidence.tolist() == pytest.approx([1, 0.6])
    assert nearest_neighbours(a, b, ratio=0.4, mutual=True)[0].tolist() == [[0, 0]]
    assert nearest_neighbours(a, b[:0], ratio=0.4)[1].dtype == torch.float32


def test_features_are_the_strongest_first(picture):
    many, few = Orb().features(picture), Orb(features=40).features(picture)
    check_features(many, few, (180, 260), 32, torch.uint8)


def test_faint_corners_count_too(picture):
    assert len(Orb().features(0.5 + picture / 20)) > 200


@pytest.mark.parametrize("size", [(180, 260), (171, 201), (150, 259)])
def test_every_level_lies_where_the_picture_does(picture, size):
    """Half a turn shows a wrong position twice; the top levels of OpenCV's own are up to 2 px off here."""
    image = picture[:, : size[0], : size[1]]
    detector = cv2.ORB.create(nfeatures=2000, fastThreshold=0)
    far = torch.tensor([size[1] - 1.0, size[0] - 1.0])
    found, turned = [], []
    for points, view in ((found, image), (turned, image.flip(1, 2))):
        grey = cv2.cvtColor((view.permute(1, 2, 0).numpy() * 255).round().astype(np.uint8), cv2.COLOR_RGB2GRAY)
        points += [(k.octave, *centre_px(k.pt, *level_scales(k.octave, size))) for k in detector.detect(grey)]
    for level in sorted({row[0] for row in found}):
        here, there = (torch.tensor([row[1:] for row in rows if row[0] == level]) for rows in (found, turned))
        distances = torch.cdist(here, far - there).min(1).values
        assert distances.median() < 1e-3, level


def test_level_scales_are_those_of_the_pyramid():
    # 600 / 1.2^7 = 167.4, 400 / 1.2^7 = 111.6
    nominal, x, y = level_scales(7, (400, 600))
    assert (nominal, x, y) == pytest.approx((1.2**7, 600 / 167, 400 / 112))
    assert centre_px((0.0, 0.0), nominal, x, y) == pytest.approx((600 / 167 / 2 - 0.5, 400 / 112 / 2 - 0.5))
    assert level_scales(0, (400, 600)) == (1, 1, 1)
    assert centre_px((17.0, 31.0), 1, 1, 1) == (17, 31)


def test_a_picture_matches_itself_turned_upside_down(picture):
    check_half_a_turn(Orb(), picture, least=150, within_px=0.01)


def test_an_empty_picture_has_no_features_and_no_matches(picture):
    check_nothing(Orb(), picture, 32, torch.uint8)


@pytest.mark.parametrize("size", [(62, 200), (200, 62), (63, 63), (64, 1000)])
def test_narrow_pictures_are_no_error(size):
    noise = torch.rand(3, *size, generator=torch.Generator().manual_seed(0))
    assert orb_features(noise, 500).size == size


@pytest.mark.parametrize(("setting", "value"), [("features", 0), ("ratio", 0.0), ("mutual", 1)])
def test_settings_out_of_range_are_named(setting, value):
    with pytest.raises(UserError, match=f"matcher.{setting}"):
        Orb(**{setting: value})


def test_the_configuration_holds_every_argument_with_its_default():
    check_configuration("orb", Orb)
