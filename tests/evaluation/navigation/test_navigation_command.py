"""python -m eval.navigation from end to end on small maps: files, schema, photos with and without truth."""

import json
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import torch
from PIL import Image
from small_site import Site, quoted, summary, table

from diffnav.checkpoints import checkpoint_sha256, save_enhancer
from diffnav.geometry.geodesy import haversine_m
from diffnav.retinex.enhancer import RetinexEnhancer

# What the "Evaluation" of the experiment promises.
ROW = {
    "method", "matcher", "mode", "condition", "queries", "fixes", "recall_5m", "recall_10m", "recall_25m", "median_m",
    "p90_m", "false_fixes", "offmap_fixes", "seconds",
}  # fmt: skip
FILES = {
    "navigation.json", "navigation.md", "per_query.csv", "records.jsonl", "integrity.json", "integrity.png",
    "map.html", "fixes.geojson", "fixes.gpx", "fixes.nmea", "figure_10.png",
}  # fmt: skip


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> dict:
    """Settings of two small maps of the embedded world, and pictures cut from them."""
    return {
        "map": ...,
        "queries": ...,
        "maps.bounds": ...,
        "maps": "world",
        "maps.count": 2,
        "maps.size": "[300,400]",
        "maps.cache": tmp_path_factory.mktemp("world"),
        "query_set": "cut",
        "query_set.size": "[160,240]",
        "query_set.per_map": 2,
        "query_set.off_map": 1,
    }


def test_files_and_schema(locate, world: dict, tmp_path: Path) -> None:
    torch.manual_seed(0)
    save_enhancer(tmp_path / "small.pt", RetinexEnhancer(width=4), "joint", {})
    settings = world | {
        "always": "[input,normal]", "checkpoint": tmp_path / "small.pt", "gate": "always", "modes": "[exhaustive]",
        "conditions": "[day,dark]", "figures": 1, "seed": 3, "query_set.per_map": 1, "darkness.gamma": "[2,2]",
    }  # fmt: skip
    printed = locate(**settings)
    out = tmp_path / "out"
    assert {path.name for path in out.iterdir()} == FILES
    assert "18 answers, 0 of them from before" in printed
    content = json.loads((out / "navigation.json").read_text(), parse_constant=lambda name: pytest.fail(name))
    rows, protocol = content["rows"], content["protocol"]
    assert [(row["method"], row["condition"]) for row in rows] == [
        (method, light) for light in ("day", "dark") for method in ("input", "normal", "small")
    ]
    for row in rows:
        assert row.keys() >= ROW
        assert (row["matcher"], row["mode"], row["queries"], row["offmap_queries"]) == ("sift", "exhaustive", 2, 1)
    by_name = {(row["method"], row["condition"]): row for row in rows}
    for light in ("day", "dark"):
        assert by_name["normal", light]["recall_5m"] == 1
        assert by_name["normal", light]["median_m"] < 0.5
        assert by_name["normal", light]["offmap_fixes"] == 0
    assert (protocol["queries"], protocol["seed"], protocol["gate"]) == (3, 3, "always")
    assert protocol["kinds"] == {"maps": "world", "query_set": "cut"}
    assert protocol["map_tiles"] == [4, 4]
    assert protocol["weights_sha256"] == {"small": checkpoint_sha256(tmp_path / "small.pt")}
    lines = table(tmp_path)
    assert len(lines) == 18
    fixes = [line for line in lines if line["status"] == "fix" and line["on_map"] == "True"]
    assert len(fixes) == sum(row["fixes"] for row in rows)
    assert all(line["reasons"] for line in lines if line["status"] == "no_fix")
    assert {line["enhanced"] for line in lines if line["method"] == "small"} == {"True"}
    # Three lines of 232 dots: three methods on a query.
    with Image.open(out / "figure_10.png") as figure:
        assert figure.size == (1040, 3 * 232)
    page = (out / "map.html").read_text()
    assert "http://" not in page.split("<body>")[0].replace("http://www.w3.org", "")
    assert "data:image/" in page
    features = json.loads((out / "fixes.geojson").read_text())["features"]
    shown = [line for line in lines if (line["method"], line["condition"]) == ("small", "dark")]
    assert len(shown) == 3
    assert {one["properties"].get("query") for one in features} >= {line["name"] for line in shown}
    ElementTree.parse(out / "fixes.gpx")
    assert (out / "fixes.nmea").read_text().count("GGA") == 3


def test_again_nothing_is_asked_and_everything_is_the_same(locate, world: dict, tmp_path: Path) -> None:
    settings = world | {"matchers": "[orb]", "query_set.size": "[60,90]", "query_set.per_map": 1, "figures": 0}
    assert "3 answers, 0 of them from before" in locate(**settings)
    first, records = summary(tmp_path), (tmp_path / "out" / "records.jsonl").read_text()
    # Where maps and features are kept decides nothing.
    elsewhere = {"paths.runs": tmp_path / "other_runs", "cache": tmp_path / "other_cache"}
    assert "3 answers, 3 of them from before" in locate(**(settings | elsewhere))
    assert summary(tmp_path)["rows"] == first["rows"]
    assert (tmp_path / "out" / "records.jsonl").read_text() == records
    # More pictures: the first ones' answers stay. Another setting of the search: none does.
    assert "5 answers, 3 of them from before" in locate(**(settings | {"query_set.per_map": 2}))
    assert "3 answers, 0 of them from before" in locate("plausibility.min_inliers=20", **settings)


def test_real_photos_with_a_table_of_truth(locate, site: Site, tmp_path: Path) -> None:
    printed = locate()
    assert "4 answers, 0 of them from before, 4 with a place" in printed
    (row,) = summary(tmp_path)["rows"]
    assert (row["queries"], row["fixes"], row["recall_5m"], row["false_fixes"]) == (4, 4, 1, 0)
    # The truth and the map agree; eight digits of a degree are a millimetre.
    assert row["p90_m"] < 0.05
    for line in table(tmp_path):
        place = float(line["latitude"]), float(line["longitude"])
        assert haversine_m(place, site.middle(line["name"])) < 0.05
        assert min(float(line["heading_deg"]), 360 - float(line["heading_deg"])) < 0.5
        assert float(line["ground_sample_distance_m"]) == pytest.approx(0.3336, rel=0.01)
    assert summary(tmp_path)["protocol"]["problems"] == []


def test_plain_photos_without_truth(locate, tmp_path: Path) -> None:
    locate(truth="none")
    (row,) = summary(tmp_path)["rows"]
    assert (row["queries"], row["fixes"], row["availability"]) == (4, 4, 1)
    unknown = ["recall_5m", "recall_10m", "recall_25m", "recall_50m", "median_m", "p90_m", "false_rate_upper"]
    assert [row[key] for key in unknown] == [None] * len(unknown)
    assert {line["error_m"] for line in table(tmp_path)} == {""}
    # Nothing to compare with: no figure; the map is there all the same.
    assert not (tmp_path / "out" / "figure_10.png").exists()
    assert (tmp_path / "out" / "map.html").stat().st_size > 10_000


def test_one_photo_and_a_limit(locate, site: Site, tmp_path: Path) -> None:
    locate(queries=quoted(site.photos / "f_2.png"), figures=0)
    assert [line["name"] for line in table(tmp_path)] == ["f_2"]
    locate(limit=2, figures=0)
    assert [line["name"] for line in table(tmp_path)] == ["f_2", "f_4"]
