"""Maps of the embedded world: windows that agree, pixels and coordinates that are where they say, the cache."""

import math
import pickle

import pytest
import torch

from diffnav.data.maps import world
from diffnav.data.maps.world import world_maps
from diffnav.data.scenes import World
from diffnav.errors import UserError
from diffnav.images import ImageError

RADIUS_M = 6_371_008.8
SIZE = (50, 70)


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(world, "BLOCK", 16)


def distance_m(a: tuple[float, float], b: tuple[float, float]) -> float:
    """Eq. 11."""
    (lat_a, lng_a), (lat_b, lng_b) = ([math.radians(angle) for angle in place] for place in (a, b))
    root = math.sin((lat_a - lat_b) / 2) ** 2 + math.cos(lat_a) * math.cos(lat_b) * math.sin((lng_a - lng_b) / 2) ** 2
    return 2 * RADIUS_M * math.asin(math.sqrt(root))


def test_any_window_is_exactly_its_part_of_the_map() -> None:
    (geo_map,) = world_maps(3, 1, SIZE)
    whole = geo_map.picture()
    assert whole.shape == (3, *SIZE)
    assert whole.std() > 0.04
    for window in ((0, 0, 1, 1), (16, 32, 16, 16), (7, 5, 30, 41), (15, 0, 2, 70), (49, 69, 1, 1), (33, 47, 17, 23)):
        top, left, height, width = window
        assert torch.equal(geo_map.read(window), whole[:, top : top + height, left : left + width])


def test_pixels_show_the_world_around_the_place_of_the_map() -> None:
    """Each of some pixels rendered alone, where its row and column put it: 40 km per step, north up."""
    maps = world_maps(5, 4, SIZE, 0.25, spacing_m=40_000)
    for geo_map, place in zip(maps, ((0, 0), (1, 0), (1, 1), (0, 1)), strict=True):
        picture = geo_map.picture()
        differences = []
        for x in range(0, 70, 23):
            for y in range(0, 50, 16):
                centre = 40_000 * place[0] + 0.25 * (x - 34.5), 40_000 * place[1] - 0.25 * (y - 24.5)
                differences.append((picture[:, y, x] - World(5).render(centre, 0.25, 0.0, (1, 1))[:, 0, 0]).abs().max())
        # Half a level of 8 bit; rounding may move a point across the edge of a shape.
        assert sum(difference <= 0.501 / 255 for difference in differences) >= len(differences) - 1


def test_pixels_lie_where_their_metres_say() -> None:
    """Over 10 m a degree is the same everywhere to nine digits."""
    (geo_map,) = world_maps(0, 1, SIZE, 0.3, origin=(47.5, -122.0))
    degree_m = math.radians(1) * RADIUS_M
    for x, y in ((34.5, 24.5), (0.0, 0.0), (69.0, 49.0), (12.25, 40.5)):
        latitude, longitude = geo_map.georeference.latlon([x, y]).tolist()
        assert latitude == pytest.approx(47.5 - 0.3 * (y - 24.5) / degree_m, abs=1e-9)
        expected = -122 + 0.3 * (x - 34.5) / (degree_m * math.cos(math.radians(latitude)))
        assert longitude == pytest.approx(expected, abs=1e-9)


def test_maps_lie_apart_each_with_its_own_origin() -> None:
    maps = world_maps(0, 10, SIZE, origin=(10.0, 20.0))
    places = [tuple(geo_map.georeference.latlon([34.5, 24.5]).tolist()) for geo_map in maps]
    assert distance_m(places[0], places[1]) == pytest.approx(50_000, abs=1e-3)
    assert distance_m(places[0], places[3]) == pytest.approx(50_000, abs=1e-3)
    assert places[1][1] > 20
    assert places[3][0] > 10
    assert min(distance_m(a, b) for k, a in enumerate(places) for b in places[:k]) > 49_000


def test_the_first_maps_are_the_same_for_any_count_and_each_is_its_own() -> None:
    few, many = world_maps(2, 2, SIZE), world_maps(2, 9, SIZE)
    for one, other in zip(few, many, strict=False):
        assert (one.name, one.fingerprint, one.size) == (other.name, other.fingerprint, SIZE)
        assert torch.equal(one.H_map_world, other.H_map_world)
    assert len({geo_map.name for geo_map in many}) == len({geo_map.fingerprint for geo_map in many}) == 9
    assert (many[0].picture() - many[1].picture()).abs().mean() > 0.02


def test_the_fingerprint_names_the_picture() -> None:
    plain, moved = world_maps(2, 1, SIZE)[0], world_maps(2, 1, SIZE, origin=(3.0, 4.0))[0]
    assert plain.fingerprint == moved.fingerprint
    others = [world_maps(3, 1, SIZE), world_maps(2, 1, (50, 71)), world_maps(2, 1, SIZE, 0.31)]
    assert len({plain.fingerprint, *(maps[0].fingerprint for maps in others)}) == 4


def test_a_view_is_the_world_through_the_map() -> None:
    (geo_map,) = world_maps(4, 1, SIZE, 0.3)
    # Ten pixels right of and six above the map's middle, turned by 90 degrees, half as far away.
    quarter = torch.tensor([[0, -0.5, 44.5 + 5], [0.5, 0, 18.5 - 5], [0, 0, 1]], dtype=torch.float64)
    view = geo_map.view(quarter, (21, 21))
    # The view's x axis runs down the map, to the south, so its top looks east.
    expected = World(4).render((3.0, 1.8), 0.15, 90.0, (21, 21))
    assert (view - expected).abs().flatten().quantile(0.99) < 1e-4


def test_what_was_drawn_is_kept(tmp_path, monkeypatch) -> None:
    plain = world_maps(3, 1, SIZE)[0].picture()
    kept = world_maps(3, 1, SIZE, cache=tmp_path)[0]
    part = kept.read((0, 0, 20, 20))
    assert len(list(tmp_path.rglob("*.png"))) == 4
    assert torch.equal(kept.picture(), plain)

    def refuse(*_: object) -> None:
        raise AssertionError("drawn again")

    monkeypatch.setattr(World, "render_homography", refuse)
    again = world_maps(3, 1, SIZE, cache=tmp_path)[0]
    assert torch.equal(again.read((0, 0, 20, 20)), part)
    assert torch.equal(again.picture(), plain)
    with pytest.raises(AssertionError, match="drawn again"):
        world_maps(4, 1, SIZE, cache=tmp_path)[0].read((0, 0, 1, 1))


def test_a_damaged_cache_is_named(tmp_path) -> None:
    (geo_map,) = world_maps(3, 1, SIZE, cache=tmp_path)
    geo_map.read((0, 0, 1, 1))
    (file,) = tmp_path.rglob("*.png")
    file.write_bytes(file.read_bytes()[:60])
    with pytest.raises(ImageError, match=rf"{file.name}[^\n]*remove it"):
        geo_map.read((0, 0, 1, 1))


def test_maps_go_to_worker_processes() -> None:
    (geo_map,) = world_maps(3, 1, SIZE)
    sent = pickle.loads(pickle.dumps(geo_map))
    assert torch.equal(sent.read((3, 4, 5, 6)), geo_map.read((3, 4, 5, 6)))


@pytest.mark.parametrize("window", [(-1, 0, 5, 5), (0, 66, 5, 5), (46, 0, 5, 5), (0, 0, 0, 5)])
def test_windows_outside_are_refused(window) -> None:
    with pytest.raises(ValueError, match="window"):
        world_maps(3, 1, SIZE)[0].read(window)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"count": 0}, r"maps\.count must be 1 or more, got 0"),
        ({"size": (0, 5)}, "size"),
        ({"size": (10,)}, r"maps\.size must be \[height, width\]"),
        ({"ground_sample_distance_m": 0.0}, "ground_sample_distance_m must be above 0"),
        ({"origin": (88.0, 0.0)}, r"maps\.origin=\[88\.0, 0\.0\]"),
        ({"origin": (47.0, 0.0), "count": 10_000}, "10000 maps"),
        ({"spacing_m": 20.0}, r"maps\.spacing_m"),
    ],
)
def test_wrong_settings_are_one_sentence(settings, message) -> None:
    with pytest.raises(UserError, match=message):
        world_maps(**{"size": SIZE, **settings})
