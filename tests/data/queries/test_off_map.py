"""Pictures of places that no map shows: worlds of their own, and parts of photographs."""

import math
import pickle

import pytest
import torch

from diffnav.darkness import DarknessModel
from diffnav.data.photos import Photo
from diffnav.data.queries.camera import Camera
from diffnav.data.queries.off_map import off_map_queries
from diffnav.errors import UserError
from diffnav.images import ImageError

SIZE = (20, 30)
PURE = Camera((0, 0), 0, 0, (0, 0), 0)


def ramp(height: int, width: int) -> torch.Tensor:
    """(3, h, w): red is (x + 0.5) / w, green (y + 0.5) / h."""
    x, y = (torch.arange(side) + 0.5 for side in (width, height))
    return torch.stack(
        [(x / width).expand(height, -1), (y / height)[:, None].expand(-1, width), torch.zeros(height, width)]
    )


def photo(name: str, height: int, width: int) -> Photo:
    return Photo(name, name, lambda: ramp(height, width))


def test_they_have_no_truth_and_a_share_of_them_is_dark() -> None:
    for photos in ((), (photo("a", 40, 60),)):
        queries = off_map_queries(12, seed=1, photos=photos, size=SIZE, dark=0.25)
        assert len({query.name for query in queries}) == 12
        assert not any(query.on_map for query in queries)
        assert all(query.truth is None for query in queries)
        assert sum(query.dark for query in queries) == 3


def test_worlds_differ_and_the_first_are_the_same_for_any_count() -> None:
    few, many = (off_map_queries(count, 5, size=SIZE, heading_deg=180, scale=(0.5, 2)) for count in (2, 4))
    for one, other in zip(few, many, strict=False):
        assert (one.name, one.heading_deg, one.ground_sample_distance_m) == (
            other.name,
            other.heading_deg,
            other.ground_sample_distance_m,
        )
        assert torch.equal(one.read(), other.read())
    pictures = [query.read_day() for query in many]
    assert all((a - b).abs().mean() > 0.02 for k, a in enumerate(pictures) for b in pictures[:k])
    assert torch.equal(pickle.loads(pickle.dumps(few[0])).read(), few[0].read())


def test_what_is_known_of_a_world_s_picture() -> None:
    queries = off_map_queries(200, 5, heading_deg=90, scale=(0.5, 2), ground_sample_distance_m=0.4)
    metres = [query.ground_sample_distance_m for query in queries]
    assert 0.2 <= min(metres) < 0.22
    assert 0.75 < max(metres) <= 0.8
    assert all(query.heading_deg <= 90 or query.heading_deg >= 270 for query in queries)
    assert off_map_queries(1, photos=(photo("a", 40, 60),))[0].heading_deg is None


def test_parts_of_photos_lie_in_them_at_the_drawn_scale() -> None:
    """The ramp's steps tell the scale, its values the place."""
    photos = (photo("large", 120, 200),)
    for query in off_map_queries(8, 2, photos=photos, size=SIZE, heading_deg=180, scale=(1.5, 1.5), camera=PURE):
        x, y = (query.read_day()[k] * side for k, side in enumerate((200, 120)))
        along = (x[10, 29] - x[10, 0], y[10, 29] - y[10, 0])
        assert math.hypot(*along) == pytest.approx(1.5 * 29, abs=1.2)
        # 8 bit: half a level is .4 of a pixel.
        assert x.min() > 0.25
        assert x.max() < 199.9
        # No fold of a mirrored edge: the middle is the mean of opposite corners.
        assert (x[0, 0] + x[-1, -1]).item() == pytest.approx((x[0, -1] + x[-1, 0]).item(), abs=1.7)
        assert (y[0, 0] + y[-1, -1]).item() == pytest.approx((y[0, -1] + y[-1, 0]).item(), abs=1.7)


def test_a_small_photo_is_enlarged_until_it_fills_the_picture() -> None:
    (query,) = off_map_queries(1, photos=(photo("small", 10, 15),), size=SIZE, scale=(2.0, 2.0), camera=PURE)
    red = query.read_day()[0]
    # The whole photo, at half of its pixels a pixel instead of two.
    assert red[10, 0].item() == pytest.approx(0.5 / 15, abs=0.03)
    assert red[10, 15].item() == pytest.approx(0.5, abs=0.03)


def test_photos_take_turns_and_damaged_ones_are_named(tmp_path) -> None:
    photos = [photo("a", 40, 60), Photo("b", "b", tmp_path / "missing.jpg")]
    queries = off_map_queries(4, photos=photos, size=SIZE)
    assert [query.name[-1] for query in queries] == ["a", "b", "a", "b"]
    with pytest.raises(ImageError, match=r"missing\.jpg"):
        queries[1].read()


def test_darkness_is_the_model_s() -> None:
    queries = off_map_queries(3, photos=(photo("a", 40, 60),), size=SIZE, darkness=DarknessModel(gamma=(2.0, 2.1)))
    assert all(2 <= query.read_both().record.gamma <= 2.1 for query in queries)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"count": 0}, r"query_set\.off_map must be 1 or more"),
        ({"dark": 1.5}, r"query_set\.dark must be a share"),
        ({"scale": (0.0, 1.0)}, r"query_set\.scale must be two numbers"),
        ({"size": (0, 5)}, "size"),
    ],
)
def test_wrong_settings_are_one_sentence(settings: dict, message: str) -> None:
    with pytest.raises(UserError, match=message):
        off_map_queries(**{"count": 1, **settings})
