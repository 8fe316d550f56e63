"""Queries by day and in the dark: Eq. 9 on the daylight picture, the truth untouched, shares exact."""

import numpy as np
import pytest
import torch

from diffnav.darkness import DarknessModel
from diffnav.data.queries.darkened import DarkenedQuery, darkened, is_dark
from diffnav.data.queries.query import Query
from diffnav.images import from_uint8, write_image

PLAIN = DarknessModel(quality=(0, 0))


def picture() -> torch.Tensor:
    return from_uint8(np.random.default_rng(0).integers(10, 201, (6, 7, 3), dtype=np.uint8))


def test_the_dark_picture_is_eq_9_of_the_day_s() -> None:
    query = darkened(Query("a", picture), PLAIN, seed=3)
    day, dark, record = query.read_both()
    assert torch.equal(day, picture())
    assert 3 <= record.gamma <= 5
    maximum = max(day.flatten().tolist())
    for value, found in zip(day.flatten().tolist(), dark.flatten().tolist(), strict=True):
        assert found * 255 == pytest.approx(round(255 * maximum ** (1 - record.gamma) * value**record.gamma), abs=1e-3)
    assert record.maximum == pytest.approx(maximum)
    assert torch.equal(record.normal, day)


def test_read_gives_what_the_camera_delivers() -> None:
    night, day = (darkened(Query("a", picture), seed=3, dark=dark) for dark in (True, False))
    assert torch.equal(night.read(), night.read_both().dark)
    assert torch.equal(day.read(), picture())
    for query in (night, day):
        assert torch.equal(query.read_day(), picture())
        assert query.read_both().dark.mean() < 0.7 * picture().mean()
    assert torch.equal(night.read(), day.read_both().dark)


def test_a_photo_in_a_file_keeps_all_that_is_known_of_it(tmp_path) -> None:
    write_image(tmp_path / "a.png", picture())
    known = {"truth": (60.4, 22.5), "heading_deg": 12.0, "height_m": 90.0, "flight": "one"}
    query = darkened(Query("a", tmp_path / "a.png", **known))
    assert torch.equal(query.read_day(), picture())
    assert {name: getattr(query, name) for name in known} == known
    assert query.on_map
    assert not darkened(Query("b", picture, on_map=False)).on_map


def test_darkness_follows_from_seed_and_name_alone() -> None:
    one, same, name, seed = (
        darkened(Query(name, picture), seed=seed).read_both().record.gamma
        for name, seed in (("a", 1), ("a", 1), ("b", 1), ("a", 2))
    )
    assert one == same
    assert len({one, name, seed}) == 3


def test_a_darkened_query_is_darkened_anew() -> None:
    query = darkened(darkened(Query("a", picture), seed=1, dark=False), PLAIN, seed=2)
    assert isinstance(query, DarkenedQuery)
    assert query.dark
    assert torch.equal(query.read(), darkened(Query("a", picture), PLAIN, seed=2).read())


@pytest.mark.parametrize(("share", "of_ten"), [(0.0, 0), (0.1, 1), (0.3, 3), (0.5, 5), (0.7, 7), (1.0, 10)])
def test_shares_are_exact(share: float, of_ten: int) -> None:
    chosen = [is_dark(number, share) for number in range(1000)]
    assert sum(chosen) == 100 * of_ten
    assert all(sum(chosen[k : k + 10]) == of_ten for k in range(0, 1000, 10))


def test_a_third_is_exact_too() -> None:
    assert sum(is_dark(number, 1 / 3) for number in range(9)) == 3
    assert sum(is_dark(number, 29 / 100) for number in range(100)) == 29
