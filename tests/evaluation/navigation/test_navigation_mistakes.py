"""A user's mistake is one sentence: exit code 2 where nothing can be done; a bad query never ends a batch."""

import os
from pathlib import Path

import pytest
import torch
from made_noise import noise
from small_site import BOUNDS, Site, bounds, quoted

HEAD = "Filename,Top_left_lat,Top_left_lon,Bottom_right_lat,Bottom_right_long"


@pytest.mark.parametrize(
    ("settings", "parts"),
    [
        ({"map": ...}, ["map is missing", "map=PATH"]),
        ({"map": "/nowhere.tif", "maps.bounds": ...}, ["no map /nowhere.tif"]),
        ({"queries": ...}, ["queries is missing", "queries=PATH"]),
        ({"queries": "/nowhere"}, ["/nowhere"]),
        ({"queries": "[a,b]"}, ["queries must be one folder"]),
        ({"truth": "/nowhere.csv"}, ["no file /nowhere.csv", "auto, none"]),
        ({"modes": "[fast]"}, ["modes must be of exhaustive, shortlist and correlation, got 'fast'"]),
        ({"modes": "[]"}, ["modes or matchers is empty"]),
        ({"matchers": "[sifd]"}, ["unknown matcher 'sifd'; there are", "orb_gms"]),
        ({"matchers": "[{sift: {ration: 1}}]"}, ["matcher sift has no setting ration"]),
        ({"gate": "dusk"}, ["gate must be one of never, always, definition, benefit, got dusk"]),
        ({"gates": "/nowhere.json"}, ["/nowhere.json", "calibrate"]),
        ({"conditions": "[night]"}, ["conditions must be of day and dark, got ['night']"]),
        ({"conditions": "[dark]"}, ["conditions asks for dark pictures", "query_set.darken=true"]),
        ({"always": "[]"}, ["there is no row to fill"]),
        ({"always": "[bright]"}, ["unknown enhancer 'bright'"]),
        ({"checkpoint": "nowhere.pt"}, ["nowhere.pt"]),
        ({"index": "annoy"}, ["index must be exact or faiss, got 'annoy'"]),
        ({"features": 0}, ["features must be a whole number of 1 or more"]),
        ({"tiles.size": 600}, ["tiles.size must be [height, width]"]),
        ({"tiles.size": "[16,900]"}, ["tiles.size", "32 or more"]),
        ({"tiles.overlap": 1.0}, ["tiles.overlap must be in [0, 1)"]),
        ({"search.winner": "best"}, ["search.winner must be inliers or matches"]),
        ({"plausibility.min_inliers": 4}, ["plausibility.min_inliers must be 5 or more"]),
        ({"prior.radius_m": -5}, ["prior.radius_m must be above 0 or null, got -5"]),
        ({"prior.place": "[47,8]"}, ["prior.place needs prior.radius_m"]),
        ({"motion": "{speed: 3}"}, ["motion must be {} or numbers", "speed_m_s", "{'speed': 3}"]),
        ({"motion": "{speed_m_s: fast}"}, ["motion must be"]),
        ({"motion": "fast"}, ["motion must be"]),
        ({"motion": "{speed_m_s: 0}"}, ["motion.speed_m_s must be above 0"]),
        ({"workers": 0}, ["workers must be a whole number of 1 or more"]),
        ({"figures": -1}, ["figures must be a whole number of 0 or more"]),
        ({"limit": 0}, ["limit must be a whole number of 1 or more"]),
        ({"query_set": "cut", "query_set.per_map": 0}, ["query_set.per_map and query_set.off_map are both 0"]),
        ({"maps": "moon"}, ["maps can be file, world"]),
        ({"calibrate": "/nowhere"}, ["calibrate needs an enhancer"]),
    ],
)
def test_settings(settings: dict, parts: list[str], mistake, tmp_path: Path) -> None:
    said = mistake(**settings)
    for part in parts:
        assert part in said
    # It was found out before anything was searched.
    assert not (tmp_path / "out" / "navigation.json").exists()


def test_a_map_that_cannot_be_read(mistake, site: Site, tmp_path: Path) -> None:
    whole = site.map.read_bytes()
    for name, content in (("text.png", b"no picture"), ("cut.png", whole[: len(whole) // 2])):
        (tmp_path / name).write_bytes(content)
        said = mistake(map=tmp_path / name)
        assert name in said
        # The mode that finds no features beforehand meets it at the first query.
        told = {"prior.radius_m": 10, "prior.heading": "true", "prior.scale": "true"}
        assert name in mistake(map=tmp_path / name, modes="[correlation]", **told, **{
            "prior.ground_sample_distance_m": 0.33,
        })  # fmt: skip


def test_a_map_without_a_place(mistake, site: Site) -> None:
    said = mistake(map=quoted(site.map), **{"maps.bounds": ...})
    assert "nothing says where it lies" in said
    assert "map.png" in said


def test_corners_and_bounds_exchanged(mistake) -> None:
    north, west, south, east = BOUNDS
    assert "exchange them" in mistake(**{"maps.bounds": bounds((south, west, north, east))})
    assert "exchange them" in mistake(**{"maps.bounds": bounds((north, east, south, west))})
    swapped = str([[north, east], [north, west], [south, west], [south, east]]).replace(" ", "")
    assert "corners" in mistake(**{"maps.bounds": ..., "maps.corners": swapped})
    longitude_first = str([[west, 100.1], [east, 100.1], [east, 100], [west, 100]]).replace(" ", "")
    assert "corners" in mistake(**{"maps.bounds": ..., "maps.corners": longitude_first})


@pytest.mark.parametrize(
    ("lines", "parts"),
    [
        (["gone.png,47.0009,8.0,47.0,8.00176"], ["maps.csv line 2", "no such file", "gone.png"]),
        ([HEAD + "map.png,47.0009,8.0,47.0,8.00176"], ["glued together", "47.0009"]),
        (["map.png,47.0009,8.0,47.0,east"], ["maps.csv line 2", "'east'", "no number"]),
        (["map.png,47.0,8.0,47.0009,8.00176"], ["maps.csv line 2", "exchange them"]),
        ([], ["lists no map"]),
    ],
)
def test_damaged_tables_of_maps(lines: list[str], parts: list[str], mistake, site: Site, tmp_path: Path) -> None:
    folder = tmp_path / "maps"
    folder.mkdir()
    (folder / "map.png").write_bytes(site.map.read_bytes())
    head = [] if lines and lines[0].startswith(HEAD) else [HEAD]
    (folder / "maps.csv").write_text("\n".join(head + lines) + "\n")
    said = mistake(map=folder / "maps.csv", **{"maps.bounds": ...})
    for part in parts:
        assert part in said


def test_a_geotiff_whose_system_makes_its_bounds_impossible(mistake, locate, tmp_path: Path) -> None:
    rasterio = pytest.importorskip("rasterio")
    levels = (noise((200, 200), 0) * 255).byte().numpy()
    facts = {"driver": "GTiff", "count": 3, "height": 200, "width": 200, "dtype": "uint8", "crs": "EPSG:4326"}
    with rasterio.open(
        tmp_path / "metres.tif", "w", transform=rasterio.Affine(0.9, 0, -93, 0, -0.9, 93), **facts
    ) as tif:
        tif.write(levels)
    said = mistake(map=tmp_path / "metres.tif", **{"maps.bounds": ...})
    assert "metres.tif" in said
    assert "latitude" in said
    # Named for what they are, they are a map.
    with pytest.raises(SystemExit):
        locate(map=tmp_path / "metres.tif", queries="/nowhere", **{
            "maps.bounds": ..., "maps.crs": "local", "maps.origin": "[47,8]",
        })  # fmt: skip


def test_a_matcher_without_keypoints(mistake, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("DIFFNAV_WEIGHTS", str(tmp_path))
    # Without its weights it says where they come from.
    assert "loftr" in mistake(matchers="[loftr]")

    class Whole:
        name, settings = "loftr", {}

        def features(self, image: torch.Tensor):
            from diffnav.matching.matches import Features

            return Features(torch.zeros(0, 2), torch.zeros(0, 1), torch.zeros(0), image.shape[1:], image)

    monkeypatch.setattr("diffnav.matching.loftr.Loftr", lambda **_: Whole())
    said = mistake(matchers="[loftr]")
    assert "matcher=loftr has no keypoints that could be kept for a map; use another" in said


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written(mistake, tmp_path: Path) -> None:
    (tmp_path / "closed").mkdir(mode=0o500)
    assert "choose another out=" in mistake(out=tmp_path / "closed" / "out")


def test_a_file_where_a_folder_should_be(mistake, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert "choose another out=" in mistake(out=tmp_path / "file" / "out")
    assert "choose another cache=" in mistake(cache=tmp_path / "file" / "cache")
    (tmp_path / "empty").mkdir()
    assert "no images in" in mistake(queries=tmp_path / "empty")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "records.jsonl").write_text("something else\n")
    assert "not the records of an evaluation" in mistake()
