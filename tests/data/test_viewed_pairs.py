"""Second views of training patches: drawn from seed and number alone, the pairs untouched."""

import math

import numpy as np
import pytest
import torch

from diffnav.darkness import DarknessModel
from diffnav.data.match_pairs.random_views import RandomViews
from diffnav.data.pairs import TrainingPairs
from diffnav.data.photos import Photo
from diffnav.data.store import PhotoStore
from diffnav.data.viewed_pairs import ViewedPairs
from diffnav.errors import UserError
from diffnav.geometry.homography import apply_homography
from diffnav.images import from_uint8

VIEWS = RandomViews(180.0, (0.8, 1.25), 0.05)


@pytest.fixture
def pairs() -> TrainingPairs:
    levels = np.random.default_rng(0).integers(256, size=(64, 80, 3), dtype=np.uint8)
    store = PhotoStore([Photo("a", "a", lambda: from_uint8(levels))], None, 32)
    return TrainingPairs(store, DarknessModel(), 32, seed=5)


def test_pairs_stay_as_they_are_and_views_repeat(pairs: TrainingPairs) -> None:
    viewed = ViewedPairs(pairs, VIEWS)
    for number in (0, 7):
        sample, again, plain = viewed[number], viewed[number], pairs[number]
        assert torch.equal(sample["low"], plain["low"])
        assert torch.equal(sample["normal"], plain["normal"])
        assert torch.equal(sample["H_view_normal"], again["H_view_normal"])
        assert sample["exposure"] == again["exposure"]
    assert not torch.equal(viewed[0]["H_view_normal"], viewed[7]["H_view_normal"])
    assert viewed[0]["exposure"] != viewed[7]["exposure"]


def test_draws_fill_their_ranges(pairs: TrainingPairs) -> None:
    samples = [ViewedPairs(pairs, VIEWS, (0.5, 2.0))[number] for number in range(200)]
    exposures = torch.stack([sample["exposure"] for sample in samples])
    assert 0.5 <= exposures.min() < 0.55
    assert 1.8 < exposures.max() <= 2
    assert abs(exposures.log().mean()) < 3 * math.log(2) / math.sqrt(3 * 200)
    # The view's middle shows the patch's, and its two halves of the x axis lie zoom x 10 px away on average.
    middle = torch.tensor([[15.5, 15.5], [25.5, 15.5], [5.5, 15.5]])
    angles = []
    for sample in samples:
        seen = apply_homography(sample["H_view_normal"], middle)
        assert (seen[0] - middle[0]).norm() < 1
        assert 10 / 1.25 * 0.9 < (seen[1] - seen[2]).norm() / 2 < 10 / 0.8 * 1.1
        angles.append(math.atan2(*(seen[1] - seen[2]).flip(0)))
    quarters = np.histogram(angles, 4, (-math.pi, math.pi))[0]
    assert quarters.min() > 30


@pytest.mark.parametrize("exposure", [(0, 1), (2, 1), (1,)])
def test_wrong_ranges_are_refused(exposure: tuple, pairs: TrainingPairs) -> None:
    with pytest.raises(UserError, match=r"views\.exposure must be two numbers"):
        ViewedPairs(pairs, VIEWS, exposure)
