from dataclasses import replace
from pathlib import Path

import pytest
from made_noise import noise

from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.maps.opening import open_maps
from diffnav.errors import UserError
from diffnav.evaluation.contest import NamedMatcher
from diffnav.evaluation.navigation.searcher import Searcher, Tiles
from diffnav.images import write_image
from diffnav.matching.orb import Orb
from diffnav.matching.sift import Sift
from diffnav.navigation.correlator import CorrelationSearch, Correlator
from diffnav.navigation.gates.gate import Never
from diffnav.navigation.localizer import Localizer, Search
from diffnav.navigation.plausibility import Plausibility
from diffnav.navigation.preparation import Preparation


def sift(**settings) -> NamedMatcher:
    return NamedMatcher("sift", Sift(**settings))


SHORTLIST = Searcher("shortlist", sift(), sift())
EXHAUSTIVE = Searcher("exhaustive", sift(), sift())
FAISS = Searcher("shortlist", sift(), sift(), "faiss")
CORRELATION = Searcher("correlation", None, None)


@pytest.mark.parametrize(
    ("searcher", "change"),
    [
        (SHORTLIST, {"mode": "exhaustive"}),
        (SHORTLIST, {"matcher": sift(ratio=0.8)}),
        (SHORTLIST, {"tile_matcher": sift(features=501)}),
        (SHORTLIST, {"matcher": NamedMatcher("sift", Orb()), "tile_matcher": NamedMatcher("sift", Orb())}),
        (SHORTLIST, {"index": "faiss"}),
        (SHORTLIST, {"tiles": Tiles((600, 800))}),
        (SHORTLIST, {"tiles": Tiles(overlap=0.5)}),
        (SHORTLIST, {"search": Search(tiles=5)}),
        (EXHAUSTIVE, {"search": Search(winner="matches")}),
        (EXHAUSTIVE, {"search": Search(headings_deg=(0.0, 90.0))}),
        (EXHAUSTIVE, {"search": Search(threshold_px=2.0)}),
        (EXHAUSTIVE, {"plausibility": Plausibility(min_inliers=16)}),
        (FAISS, {"tiles": Tiles(indexed=200)}),
        (CORRELATION, {"correlation": CorrelationSearch(min_lead=1.3)}),
        (CORRELATION, {"correlation": CorrelationSearch(scales=(1.0,))}),
    ],
)
def test_a_setting_that_decides_an_answer_changes_the_fingerprint(searcher: Searcher, change: dict):
    assert replace(searcher, **change).fingerprint != searcher.fingerprint


@pytest.mark.parametrize(
    ("searcher", "change"),
    [
        (SHORTLIST, {"correlation": CorrelationSearch(min_lead=1.3)}),
        (SHORTLIST, {"tiles": Tiles(indexed=200)}),
        (SHORTLIST, {"tiles": Tiles([600, 900]), "search": Search(headings_deg=[0.0])}),
        (SHORTLIST, {"matcher": sift(), "tile_matcher": sift()}),
        (EXHAUSTIVE, {"search": Search(tiles=5)}),
        (EXHAUSTIVE, {"index": "faiss"}),
        (CORRELATION, {"search": Search(tiles=5), "plausibility": Plausibility(min_inliers=16)}),
        (CORRELATION, {"tiles": Tiles((100, 100)), "index": "faiss"}),
    ],
)
def test_a_setting_that_does_not_leaves_it(searcher: Searcher, change: dict):
    assert replace(searcher, **change).fingerprint == searcher.fingerprint


@pytest.fixture
def maps(tmp_path: Path) -> list[GeoMap]:
    write_image(tmp_path / "map.png", noise((120, 160), 0))
    return open_maps(tmp_path / "map.png", bounds=[47.001, 8.0, 47.0, 8.001])


def test_features_are_found_once(maps: list[GeoMap], tmp_path: Path):
    searcher = replace(SHORTLIST, tiles=Tiles((100, 100), 0.0))
    assert searcher.tiles.windows(maps[0]) == [(y, x, 100, 100) for y in (0, 20) for x in (0, 60)]
    (found,) = searcher.prepare(maps, tmp_path / "features")
    files = {path: path.stat().st_mtime_ns for path in (tmp_path / "features").rglob("*")}
    (again,) = searcher.prepare(maps, tmp_path / "features")
    assert (again.keypoints == found.keypoints).all()
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "features").rglob("*")} == files


def test_features_of_other_code_are_not_taken_for_these(maps: list[GeoMap], tmp_path: Path):
    """A release that finds other keypoints with the same settings must not meet those of the last one."""
    SHORTLIST.prepare(maps, tmp_path / "features")
    other = NamedMatcher("sift", Sift())
    # As if its module's text had changed.
    other.__dict__["fingerprint"] = "f" * 64
    before = set((tmp_path / "features").iterdir())
    replace(SHORTLIST, tile_matcher=other).prepare(maps, tmp_path / "features")
    assert len(set((tmp_path / "features").iterdir()) - before) == 1


def test_each_mode_opens_its_localizer(maps: list[GeoMap], tmp_path: Path):
    ready = Preparation(Never(), lambda image: image)
    assert isinstance(CORRELATION.open(maps, tmp_path, ready), Correlator)
    assert CORRELATION.prepare(maps, tmp_path) == []
    assert CORRELATION.matcher_name == "gradients"
    exhaustive = EXHAUSTIVE.open(maps, tmp_path, ready)
    assert isinstance(exhaustive, Localizer)
    assert exhaustive.shortlist is None
    assert SHORTLIST.open(maps, tmp_path, ready).shortlist is not None


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: Searcher("fast", sift(), sift()),
            "modes must be of exhaustive, shortlist and correlation, got 'fast'",
        ),
        (lambda: Searcher("shortlist", sift(), sift(), "annoy"), "index must be exact or faiss, got 'annoy'"),
        (lambda: Tiles(600), r"tiles.size must be \[height, width\] in pixels, got 600"),
        (lambda: Tiles(indexed=0), "tiles.indexed must be 1 or more, got 0"),
    ],
)
def test_mistakes(make, message: str):
    with pytest.raises(UserError, match=message):
        make()
