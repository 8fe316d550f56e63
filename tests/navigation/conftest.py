"""A piece of the embedded world, drawn once, and queries cut from it."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from localizing import PLAIN, SIFT
from made_maps import picture_map
from made_noise import noise

from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.maps.world import world_maps
from diffnav.data.queries.cut import CutQuery, cut_queries
from diffnav.data.queries.off_map import off_map_queries
from diffnav.data.queries.query import Query
from diffnav.matching.matches import Matcher
from diffnav.matching.sift import Sift
from diffnav.navigation.feature_store import stored_features
from diffnav.navigation.localizer import Localizer
from diffnav.navigation.reference import Reference
from diffnav.navigation.tiles import tile_windows


@pytest.fixture(scope="session")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that keeps what was drawn of the world."""
    return tmp_path_factory.mktemp("world")


@pytest.fixture(scope="session")
def world_map(drawn: Path) -> GeoMap:
    """600 x 900 pixels of .3 m."""
    return world_maps(0, 1, (600, 900), cache=drawn)[0]


@pytest.fixture(scope="session")
def world_queries(world_map: GeoMap) -> list[CutQuery]:
    """Five daylight pictures of the map at headings all around the compass and .6 to 1 times its pixels."""
    queries = cut_queries([world_map], 5, size=(240, 320), heading_deg=180.0, scale=(0.6, 1.0), dark=0.0)
    return [_kept(query) for query in queries]  # type: ignore[misc]


@pytest.fixture(scope="session")
def other_queries() -> list[Query]:
    """Two daylight pictures of other worlds."""
    queries = off_map_queries(2, size=(240, 320), heading_deg=180.0, scale=(0.6, 1.0), dark=0.0)
    return [_kept(query) for query in queries]


@pytest.fixture(scope="session")
def store(drawn: Path) -> Callable[[Sequence[GeoMap], Matcher], Reference]:
    """The reference of maps cut into tiles of at most 400 x 500, by a matcher."""

    def stored(maps: Sequence[GeoMap], matcher: Matcher) -> Reference:
        return Reference(
            [stored_features(one, tile_windows(one.size, (400, 500), 0.33), matcher, drawn / "f") for one in maps]
        )

    return stored


@pytest.fixture(scope="session")
def reference(store: Callable, world_map: GeoMap) -> Reference:
    """Six tiles of the world, and one far away of noise."""
    return store([picture_map(noise((200, 300), 3), "noise", origin=(10.0, 20.0)), world_map], Sift(1500))


@pytest.fixture(scope="session")
def localizer(reference: Reference) -> Localizer:
    return Localizer(reference, SIFT, PLAIN)


def _kept(query: Query) -> Query:
    """The query with its picture drawn once."""
    picture = query.read()
    object.__setattr__(query, "image", lambda: picture)
    return query
