"""The page for a browser: nothing is fetched, no name becomes HTML, everything known is on it."""

import html
import re
import shutil
import subprocess
from datetime import datetime
from html.parser import HTMLParser

import pytest
import torch
from example_fixes import NASTY, fix, flight, lost

from diffnav.data.maps.geo_map import GeoMap
from diffnav.geometry.georeference import AffineGeoreference, LocalMetres
from diffnav.navigation.exports.html_map import write_html_map
from diffnav.navigation.exports.legend import legend_html
from diffnav.navigation.exports.popups import fix_html

EVIL = "<img src=http://evil.example/x onerror=alert(1)>"
FETCHED = {("script", "src"), ("img", "src"), ("link", "href"), ("iframe", "src"), ("source", "src"), ("use", "href")}


class Elements(HTMLParser):
    """All elements of a page with their attributes, and the text of styles and scripts."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.found: list[tuple[str, dict]] = []
        self.texts: dict[str, str] = {"style": "", "script": "", "title": ""}

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))

    def handle_data(self, data):
        if self.lasttag in self.texts:
            self.texts[self.lasttag] += data


def map_at(name, origin, colour=0.5):
    picture = torch.full((3, 60, 80), colour)
    georeference = AffineGeoreference((60, 80), LocalMetres(origin), (50.0, 0.0, -2000.0, 0.0, -50.0, 1500.0))

    def read(window):
        top, left, height, width = window
        return picture[:, top : top + height, left : left + width]

    return GeoMap(name, georeference, read, name)


@pytest.fixture
def page(tmp_path):
    maps = [map_at(EVIL, (-17.91, 179.99)), map_at("b", (-17.91, -179.95))]
    fixes = [*flight(), lost(EVIL)]
    write_html_map(tmp_path / "new" / "map.html", fixes, maps, {"1": (-17.901, 179.97), NASTY: (-17.91, 180.015)}, EVIL)
    return tmp_path / "new" / "map.html"


def parsed(path):
    elements = Elements()
    elements.feed(path.read_text(encoding="utf-8"))
    return elements


def test_nothing_is_fetched(page):
    elements = parsed(page)
    for tag, attributes in elements.found:
        for name in ("src", "href", "srcset", "data", "action", "style"):
            value = attributes.get(name) or ""
            assert "//" not in value, (tag, name, value)
        assert not any((tag, name) in FETCHED for name in attributes)
    assert "@import" not in elements.texts["style"]
    assert {url[:10] for url in re.findall(r"url\(([^)]+)\)", elements.texts["style"])} <= {"data:image", "#default#V"}
    # The page's own script, after Leaflet: pictures are data, and there are no tiles.
    own = elements.texts["script"][elements.texts["script"].index("L.map(") :]
    assert "tileLayer" not in own
    assert "http" not in own.replace(html.escape(EVIL), "").replace("http://evil.example", "")
    assert "$(" not in own
    assert own.count('"data:image/jpeg;base64,') == 2
    assert "sourceMappingURL" not in elements.texts["script"]


def test_leaflet_is_written_into_it(page):
    text = page.read_text(encoding="utf-8")
    assert "Leaflet 1.9" in text
    assert text.index("Leaflet 1.9") < text.index("L.map(")


def test_no_name_becomes_html(page):
    elements = parsed(page)
    text = page.read_text(encoding="utf-8")
    assert EVIL not in text
    assert NASTY not in text
    assert "</script>\ufffd" not in text
    assert {tag for tag, _ in elements.found} <= {
        "html", "head", "meta", "title", "style", "script", "body", "div", "i", "details", "summary", "a",
    }  # fmt: skip
    assert elements.texts["title"].strip() == EVIL


def test_maps_fixes_and_truths_are_drawn_next_to_each_other(page):
    own = page.read_text(encoding="utf-8").split("L.map(")[1]
    dots = [float(x) for x in re.findall(r"L\.circleMarker\(\s*\[[-\d.]+, ([-\d.]+)\]", own)]
    # Five fixes, two truths; all in the first map's world.
    assert sorted(dots) == pytest.approx([179.97, 179.97, 179.985, 180.015, 180.015, 180.04, 180.05])
    assert [float(x) for x in re.findall(r"L\.circle\(\s*\[[-\d.]+, ([-\d.]+)\]", own)] == pytest.approx(
        [179.97, 179.985, 180.04]
    )
    wests = [float(x) for x in re.findall(r"L\.imageOverlay\(\s*\"[^\"]+\",\s*\[\[[-\d.]+, ([-\d.]+)\]", own)]
    assert len(wests) == 2
    assert wests[1] - wests[0] == pytest.approx(0.06, abs=1e-3)


def test_a_popup_tells_what_is_known():
    known = fix(
        "IMG_1.jpg", 10.0, 20.0, sigma_m=3.21, heading_deg=271.5, ground_sample_distance_m=0.2, inliers=31, matches=55,
        map="Fiji", tile="3", enhanced=True, definition=4.25, milliseconds={"gate": 2.0, "match": 300.0},
        time=datetime(2024, 5, 6, 7, 8, 9),
    )  # fmt: skip
    text = re.sub("<[^>]+>", "|", fix_html(known, (10.0, 20.001)))
    # A thousandth of a degree of longitude at 10 degrees of latitude.
    for part in ("IMG_1.jpg", "fix", "10.0000000, 20.0000000", "109.5 m", "3.2 m", "271.5", "0.200 m", "31 of 55",
                 "Fiji, tile 3", "yes", "4.25", "302 (gate 2, match 300)", "2024-05-06 07:08:09 UTC"):  # fmt: skip
        assert f"|{part}" in text, part
    without = fix_html(lost(EVIL))
    assert "3 inliers, 8 are needed" in without
    assert "no fix" in without
    assert html.escape(EVIL) in without
    assert "place" not in without


def test_the_legend_counts_and_lists_the_lost():
    text = legend_html([*flight(), lost(EVIL)], {"1": (0, 0), "3": (0, 0)}, ["a&b", "c"])
    plain = html.unescape(re.sub("<[^>]+>", "|", text))
    for part in ("fix, and its footprint: 4 of 9", "coasted: 1 of 9", "truth: 2 of 9", "error: 1 of 9", "no fix: 4"):
        assert part in plain
    assert f"{EVIL}: 3 inliers, 8 are needed" in html.unescape(text)
    assert re.findall(r'data-view="(\d)">([^<]+)<', text) == [("0", "a&amp;b"), ("1", "c")]
    assert "go to" not in legend_html([], {}, ["only"])


@pytest.mark.parametrize("fixes", [[], [lost()], [fix()]])
@pytest.mark.parametrize("count", [0, 1])
def test_little_or_nothing_makes_a_page_too(tmp_path, fixes, count):
    write_html_map(tmp_path / "map.html", fixes, [map_at("m", (10.0, 20.0))] * count)
    own = (tmp_path / "map.html").read_text(encoding="utf-8").split("L.map(")[1]
    assert own.count("L.imageOverlay(") == count
    assert ("map.fitBounds([" in own) == bool(count or fixes == [fix()])


def test_maps_far_apart_open_on_the_first(tmp_path):
    maps = [map_at("near", (10.0, 20.0)), map_at("far", (10.0, 25.0))]
    write_html_map(tmp_path / "map.html", [fix()], maps)
    own = (tmp_path / "map.html").read_text(encoding="utf-8").split("L.map(")[1]
    east = float(re.search(r"map\.fitBounds\(\[\[[^]]+\], \[[-\d.]+, ([-\d.]+)\]\]", own)[1])
    # 2 km east of the middle.
    assert 20.01 < east < 20.03


@pytest.mark.skipif(not shutil.which("chromium"), reason="needs chromium")
def test_a_browser_without_network_draws_it(page, tmp_path):
    command = [
        "chromium", "--headless", "--no-sandbox", "--disable-gpu", "--host-resolver-rules=MAP * ~NOTFOUND",
        "--virtual-time-budget=3000", f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", page.as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    shown = done.stdout
    assert len(re.findall(r"<img[^>]+leaflet-image-layer[^>]+src=\"data:image/jpeg", shown)) == 2
    assert "leaflet-control-layers-overlays" in shown
    assert "leaflet-control-scale-line" in shown
    assert "<canvas" in shown
    assert html.escape(EVIL, quote=False) in shown
