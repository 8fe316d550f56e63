"""eval.navigation with every kind of map, with a prior, along a flight, by day and dark, on photos of elsewhere."""

import json
import math
from pathlib import Path

import pytest
import torch
from small_site import BOUNDS, MAP_SIZE, Site, bounds, quoted, summary, table

from diffnav.geometry.geodesy import haversine_m
from diffnav.images import read_image, write_image


def corners() -> str:
    north, west, south, east = BOUNDS
    return str([[north, west], [north, east], [south, east], [south, west]]).replace(" ", "")


def placed(kind: str, site: Site, folder: Path) -> dict:
    """The site's map as a folder, table, world file or GeoTIFF says where it lies."""
    north, west, south, east = BOUNDS
    across, down = (east - west) / MAP_SIZE[1], (south - north) / MAP_SIZE[0]
    if kind == "corners":
        return {"map": quoted(site.map), "maps.corners": corners()}
    if kind == "geotiff":
        rasterio = pytest.importorskip("rasterio")
        levels = (read_image(site.map) * 255).round().byte().numpy()
        facts = {"driver": "GTiff", "count": 3, "height": MAP_SIZE[0], "width": MAP_SIZE[1], "dtype": "uint8"}
        place = {"crs": "EPSG:4326", "transform": rasterio.Affine(across, 0, west, 0, down, north)}
        with rasterio.open(folder / "map.tif", "w", **facts, **place) as file:
            file.write(levels)
        return {"map": folder / "map.tif"}
    (folder / "map.png").write_bytes(site.map.read_bytes())
    if kind == "table":
        head = "Filename,Top_left_lat,Top_left_lon,Bottom_right_lat,Bottom_right_long"
        (folder / "maps.csv").write_text(f"{head}\nmap.png,{north},{west},{south},{east}\n")
        return {"map": folder}
    # Of a world file the numbers are those of the first pixel's centre.
    lines = [across, 0, 0, down, west + across / 2, north + down / 2]
    (folder / "map.pgw").write_text("\n".join(map(repr, lines)) + "\n")
    return {"map": folder / "map.png"}


@pytest.mark.parametrize("kind", ["corners", "geotiff", "table", "world file"])
def test_every_kind_of_map_leads_to_the_same_place(kind: str, locate, site: Site, tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    settings = {"maps.bounds": ..., "figures": 0, "limit": 1} | placed(kind, site, tmp_path / "maps")
    locate(**settings)
    (line,) = table(tmp_path)
    assert haversine_m((float(line["latitude"]), float(line["longitude"])), site.middle("f_3")) < 0.05


def test_correlation_within_a_prior(locate, site: Site, tmp_path: Path) -> None:
    told = {"prior.heading": "true", "prior.scale": "true", "prior.ground_sample_distance_m": 0.3336}
    told |= {"correlation.headings_deg": "[0.0]", "correlation.scales": "[1.0]", "correlation.longest_side": 160}
    locate(modes="[correlation]", figures=0, **told, **{"prior.radius_m": 20})
    (row,) = summary(tmp_path)["rows"]
    assert (row["matcher"], row["fixes"], row["recall_5m"]) == ("gradients", 4, 1)
    assert json.loads((tmp_path / "out" / "integrity.json").read_text()) == {"curves": []}
    # A place can be given instead; photos that were taken beyond the circle are not found.
    middle = bounds(site.middle("f_2"))
    locate(modes="[correlation]", figures=0, **told, **{"prior.radius_m": 5, "prior.place": middle})
    assert [line["status"] for line in table(tmp_path)] == ["no_fix", "fix", "no_fix", "no_fix"]
    locate(modes="[correlation]", figures=0)
    assert {line["reasons"] for line in table(tmp_path)} == {"correlation needs an expected place, heading and scale"}


def test_a_prior_that_excludes_the_place_is_no_fix(locate, site: Site, tmp_path: Path) -> None:
    locate(
        queries=quoted(site.photos / "f_1.png"), figures=0, **{"prior.radius_m": 5, "prior.place": "[47.0001,8.0015]"}
    )
    (line,) = table(tmp_path)
    assert (line["status"], line["latitude"]) == ("no_fix", "")
    assert "from the expected place, more than 5 m" in line["reasons"] or "inliers" in line["reasons"]


def test_motion_follows_the_flight(locate, site: Site, tmp_path: Path) -> None:
    flight = tmp_path / "flight"
    for path in site.photos.iterdir():
        (flight / path.name).parent.mkdir(exist_ok=True)
        (flight / path.name).write_bytes(path.read_bytes())
    write_image(flight / "f_3.png", torch.zeros(3, 120, 160))
    locate(queries=flight, motion="{}", figures=0)
    lines = {line["name"]: line for line in table(tmp_path)}
    assert [line["status"] for line in lines.values()] == ["fix", "fix", "coasted", "fix"]
    # From two places a second apart the third is where they lead: 16.7 m on, as it is on the map.
    place = float(lines["f_3"]["latitude"]), float(lines["f_3"]["longitude"])
    assert haversine_m(place, site.middle("f_3")) < 3
    assert math.isfinite(float(lines["f_3"]["sigma_m"]))
    assert (tmp_path / "out" / "fixes.nmea").read_text().count("GGA") == 4
    # Alone it is a picture in which nothing can be matched.
    locate(queries=flight, figures=0)
    assert [line["status"] for line in table(tmp_path)] == ["fix", "fix", "no_fix", "fix"]


def test_photos_asked_by_day_and_dark(locate, tmp_path: Path) -> None:
    dark = {"query_set.darken": "true", "darkness.gamma": "[6,6]", "always": "[input,normal]", "figures": 0}
    locate(conditions="[day,dark]", **dark)
    rows = {(row["method"], row["condition"]): row for row in summary(tmp_path)["rows"]}
    assert {key: row["queries"] for key, row in rows.items()} == dict.fromkeys(rows, 4)
    assert rows["normal", "dark"]["fixes"] == rows["input", "day"]["fixes"] == 4
    assert rows["input", "dark"]["fixes"] < 4
    # As delivered: half of them dark.
    locate(**dark)
    rows = {(row["method"], row["condition"]): row for row in summary(tmp_path)["rows"]}
    assert {key: row["queries"] for key, row in rows.items()} == dict.fromkeys(rows, 2)
    assert len(rows) == 4


def test_photos_of_another_place(locate, tmp_path: Path) -> None:
    """Their own truth says that no map shows them: a note, and with on_map=false a measure of false fixes."""
    north, west, south, east = BOUNDS
    locate(limit=2, figures=0, **{"maps.bounds": bounds((north + 1, west, south + 1, east))})
    (note,) = summary(tmp_path)["protocol"]["problems"]
    assert note.startswith("the truth of 4 of 4 photos lies on no map, the first is f_1; ")
    away = {"query_set.on_map": "false", "maps.bounds": bounds((north + 1, west, south + 1, east))}
    locate(limit=2, figures=0, **away)
    (row,) = summary(tmp_path)["rows"]
    # The map is that of the photos all the same: both fixes are wrong.
    assert (row["queries"], row["offmap_queries"], row["offmap_fixes"]) == (0, 2, 2)
    assert row["recall_5m"] is None
