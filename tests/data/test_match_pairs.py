"""Queries, references and the truth between them: checked on marked points and against slow loops."""

import math

import numpy as np
import pytest
import torch

from diffnav.darkness import DarknessModel, apply_gamma
from diffnav.data.lol import lol_photos
from diffnav.data.match_pairs.homography import HomographyPairs
from diffnav.data.match_pairs.lol import LolPairs
from diffnav.data.match_pairs.random_views import RandomViews
from diffnav.data.match_pairs.rot180 import Rot180Pairs
from diffnav.data.pair_source import PairSource
from diffnav.data.photos import Photo
from diffnav.errors import UserError
from diffnav.geometry.homography import apply_homography
from diffnav.images import quantise, read_image, write_image

MARKS = [(55.0, 35.0), (70.0, 60.0), (60.0, 45.0)]
SIZE = (96, 128)
# No JPEG: a mark's place is then exact to a fraction of a pixel.
PLAIN = DarknessModel(quality=(0, 0))


def marked(marks=MARKS, size=SIZE):
    """(3, h, w): in each channel a bright blob at one mark."""
    y, x = torch.meshgrid(torch.arange(float(size[0])), torch.arange(float(size[1])), indexing="ij")
    return torch.stack([torch.exp(-((x - px) ** 2 + (y - py) ** 2) / 18) for px, py in marks])


def centroids(image, shown):
    y, x = torch.meshgrid(*(torch.arange(float(side)) for side in image.shape[1:]), indexing="ij")
    weights = (image - 0.2).clamp(min=0) * shown
    return torch.stack([torch.stack([(a * w).sum() / w.sum() for a in (x, y)]) for w in weights])


def photos(count=1):
    return [Photo(f"p{k}", "site", marked) for k in range(count)]


def test_rot180_is_the_pair_of_table_1_turned_after_enhancement():
    source = PairSource(photos(), DarknessModel(), seed=4)
    pair = Rot180Pairs(source).read(source.photos[0])
    expected = source.read(source.photos[0])
    assert torch.equal(pair.pair["low"], expected["low"])
    assert torch.equal(pair.reference, expected["normal"])
    assert pair.visible is None
    query = pair.query(pair.pair["normal"])
    assert query[0, 0, 0] == pair.pair["normal"][0, -1, -1]
    turned = [(127 - x, 95 - y) for x, y in MARKS]
    np.testing.assert_allclose(centroids(query, 1), turned, atol=0.05)
    np.testing.assert_allclose(apply_homography(pair.H_query_reference, torch.tensor(turned)), MARKS)


@pytest.mark.parametrize("seed", range(4))
def test_homography_truth_on_marked_points(seed):
    """Where the marks lie in the view, and where H says that they lie in the reference."""
    pairs = HomographyPairs(PairSource(photos(), PLAIN, seed))
    pair = pairs.read(pairs.photos[0])
    assert torch.equal(pair.reference, quantise(marked()))
    found = apply_homography(pair.H_query_reference, centroids(pair.query(pair.pair["normal"]), pair.visible))
    np.testing.assert_allclose(found, MARKS, atol=0.25)


def test_the_view_is_darkened_not_the_picture():
    pairs = HomographyPairs(PairSource(photos(), PLAIN, 1))
    pair = pairs.read(pairs.photos[0])
    record = pair.pair["record"]
    assert record.maximum == pair.pair["normal"].max()
    assert torch.equal(pair.pair["low"], quantise(apply_gamma(pair.pair["normal"], record)))
    # The same gamma as without the view.
    assert record.gamma == PairSource(photos(), PLAIN, 1).read(pairs.photos[0])["record"].gamma


def test_what_is_visible_against_a_slow_loop():
    pairs = HomographyPairs(PairSource(photos(), PLAIN, 2), scale=(0.7, 0.7))
    pair = pairs.read(pairs.photos[0])
    assert 0.3 < pair.visible.float().mean() < 0.8
    for y in range(0, SIZE[0], 7):
        for x in range(0, SIZE[1], 7):
            u, v = apply_homography(pair.H_query_reference, torch.tensor([[x, y]]))[0].tolist()
            assert pair.visible[y, x].item() == (0 <= u <= 127 and 0 <= v <= 95)


def test_views_keep_to_their_range():
    views = RandomViews(90.0, (0.7, 1.4), 0.1)
    angles, scales, tilts = [], [], []
    for seed in range(200):
        H = views.draw(SIZE, seed, "a")
        middle = torch.tensor([[63.5, 47.5]], dtype=torch.float64)
        assert torch.allclose(apply_homography(H, middle), middle)
        right = apply_homography(H, middle + torch.tensor([[1e-4, 0.0]])) - middle
        x, y = right[0].tolist()
        angles.append(math.degrees(math.atan2(y, x)))
        scales.append(1e-4 / math.hypot(x, y))
        tilts.append([(H[2, i] * SIZE[1 - i] / 2 / (H[2] @ torch.tensor([63.5, 47.5, 1.0]).double())) for i in (0, 1)])
    assert -90 <= min(angles) < -80
    assert 80 < max(angles) <= 90
    assert 0.7 <= min(scales) * 1.001 < 0.72
    assert 1.37 < max(scales) <= 1.4 * 1.001
    assert 0.095 < np.abs(tilts).max() <= 0.1 + 1e-9
    # Evenly on a logarithmic scale: half of them enlarge.
    assert 70 < sum(scale > (0.7 * 1.4) ** 0.5 for scale in scales) < 130


def test_a_view_depends_on_seed_and_name_alone():
    views = RandomViews()
    assert torch.equal(views.draw(SIZE, 3, "a"), views.draw(SIZE, 3, "a"))
    assert not torch.equal(views.draw(SIZE, 3, "a"), views.draw(SIZE, 3, "b"))
    assert not torch.equal(views.draw(SIZE, 3, "a"), views.draw(SIZE, 4, "a"))


@pytest.mark.parametrize(
    ("setting", "value"),
    [("scale", (0, 1)), ("scale", (1.2, 0.8)), ("scale", (1,)), ("rotation_deg", 200), ("perspective", 0.5)],
)
def test_settings_out_of_range_are_named(setting, value):
    with pytest.raises(UserError, match=f"pairs.{setting}"):
        HomographyPairs(PairSource(photos(), PLAIN), **{setting: value})


def test_real_darkness_is_enhanced_as_it_was_taken(tmp_path):
    dark = 0.2 * marked() + 0.05 * torch.rand(3, *SIZE, generator=torch.Generator().manual_seed(0))
    write_image(tmp_path / "low" / "a.png", dark)
    write_image(tmp_path / "high" / "a.png", marked())
    pairs = LolPairs(PairSource(lol_photos(tmp_path), PLAIN, 5))
    pair = pairs.read(pairs.photos[0])
    assert torch.equal(pair.pair["low"], read_image(tmp_path / "low" / "a.png"))
    assert pair.pair["record"] is None
    assert torch.equal(pair.reference, pair.pair["normal"])
    found = apply_homography(pair.H_query_reference, centroids(pair.query(pair.pair["normal"]), pair.visible))
    np.testing.assert_allclose(found, MARKS, atol=0.25)


def test_pictures_without_a_real_dark_one_are_no_lol_pairs():
    with pytest.raises(UserError, match="no real dark picture"):
        LolPairs(PairSource(photos(), PLAIN)).read(photos()[0])


def test_a_digest_changes_with_every_pixel_and_with_the_truth():
    source = PairSource(photos(), PLAIN, 3)
    turned, seen = Rot180Pairs(source).read(source.photos[0]), HomographyPairs(source).read(source.photos[0])
    assert turned.digest() == Rot180Pairs(source).read(source.photos[0]).digest()
    touched = turned.reference.clone()
    touched[1, 5, 5] += 1 / 255
    fields = [
        {"reference": touched},
        {"H_query_reference": turned.H_query_reference + 1e-9},
        {"view": None},
        {"visible": torch.ones(SIZE, dtype=torch.bool)},
    ]
    others = [type(turned)(**{**turned.__dict__, **change}) for change in fields]
    assert len({pair.digest() for pair in (turned, seen, *others)}) == 6
