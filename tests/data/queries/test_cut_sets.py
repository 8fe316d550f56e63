"""Sets of cut queries: drawn from seed and name alone, half of them dark, seen by a camera; the paper's set."""

import pickle

import numpy as np
import pytest
import torch
from ramp_maps import ANY, PURE, SIZE, degrees_map

from diffnav.darkness import DarknessModel
from diffnav.data.maps.world import world_maps
from diffnav.data.queries.camera import Camera
from diffnav.data.queries.cut import cut_queries
from diffnav.errors import UserError
from diffnav.images import jpeg_round_trip, to_uint8


def test_queries_follow_from_seed_and_name_alone() -> None:
    maps = [degrees_map("a"), degrees_map("b")]
    few, many = cut_queries(maps[1:], 3, 7, **ANY), cut_queries(maps, 5, 7, **ANY)
    assert [query.name for query in few] == [query.name for query in many[5:8]]
    assert len({query.name for query in many}) == 10
    for one, other in zip(few, many[5:8], strict=True):
        assert (one.truth, one.capture, one.dark, one.seed) == (other.truth, other.capture, other.dark, other.seed)
        assert torch.equal(one.H_query_map, other.H_query_map)
        assert torch.equal(one.read(), other.read())
        assert torch.equal(one.read(), one.read())
    truths = [query.truth for query in many + cut_queries(maps, 5, 8, **ANY)]
    assert len(set(truths)) == 20
    assert len({query.capture for query in many}) == len({query.seed for query in many}) == 10


def test_half_of_each_map_s_queries_are_dark_as_eq_9_says() -> None:
    queries = cut_queries([degrees_map("a"), degrees_map("b")], 8, 1, size=SIZE, darkness=DarknessModel(quality=(0, 0)))
    for name in ("a", "b"):
        assert sum(query.dark for query in queries if query.map == name) == 4
    for query in queries[:4]:
        day, dark, record = query.read_both()
        maximum = day.max().item()
        expected = np.round(255 * maximum * (day.numpy() / maximum) ** record.gamma)
        np.testing.assert_allclose(dark * 255, expected, atol=1e-3)
        assert torch.equal(query.read(), dark if query.dark else day)


def test_the_camera_stands_between_map_and_day() -> None:
    pure, noisy, shifted = (
        cut_queries([degrees_map()], 1, size=SIZE, camera=camera)[0]
        for camera in (PURE, Camera((0, 0), 0, 0, (0.05, 0.05), 0), Camera((0, 0), 0.3, 0, (0, 0), 95))
    )
    assert (noisy.read_day() - pure.read_day())[:2].std().item() == pytest.approx(0.05, rel=0.1)
    gain = torch.tensor(shifted.capture.gain)[:, None, None]
    levels = to_uint8((pure.read_day() * gain).clamp(0, 1))
    expected = jpeg_round_trip(levels, 95).astype(int)
    # What the picture lost by being rounded before its gain, and what JPEG makes of it.
    assert np.abs(to_uint8(shifted.read_day()).astype(int) - expected).mean() < 2


def test_the_paper_s_experiment() -> None:
    maps = world_maps(0, 5)
    queries = cut_queries(maps, 10)
    assert len(queries) == 50
    for geo_map in maps:
        own = [query for query in queries if query.map == geo_map.name]
        assert (len(own), sum(query.dark for query in own)) == (10, 5)
    assert all(query.ground_sample_distance_m == pytest.approx(0.3) for query in queries)
    assert sum(query.dark for query in cut_queries(maps[:1], 7, dark=3 / 7)) == 3


def test_queries_go_to_worker_processes() -> None:
    query = cut_queries(world_maps(1, 1, (60, 80)), 2, size=SIZE)[1]
    assert torch.equal(pickle.loads(pickle.dumps(query)).read(), query.read())


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"per_map": 0}, r"query_set\.per_map must be 1 or more, got 0"),
        ({"dark": -0.1}, r"query_set\.dark must be a share from 0 to 1, got -0\.1"),
        ({"heading_deg": 181.0}, r"query_set\.heading_deg must be from 0 to 180, got 181"),
        ({"scale": (2.0, 0.5)}, r"query_set\.scale must be two numbers, low and high"),
        ({"scale": 2.0}, r"query_set\.scale must be two numbers"),
        ({"tilt": 0.4}, r"query_set\.tilt"),
        ({"size": (20,)}, r"query_set\.size must be \[height, width\]"),
        ({"size": (20.5, 30)}, "size"),
    ],
)
def test_wrong_settings_are_one_sentence(settings: dict, message: str) -> None:
    with pytest.raises(UserError, match=message):
        cut_queries([degrees_map()], **{"per_map": 1, "size": SIZE, **settings})
