"""A folium map as one HTML text that loads nothing: Leaflet itself is written into it."""

import base64
import html
import re
from pathlib import Path

import folium
from branca.element import Element, Figure, MacroElement
from folium.template import Template
from xstatic.pkg import leaflet

_PICTURE = re.compile(r"url\((images/[\w.-]+)\)")
_SOURCE_MAP = re.compile(r"//# sourceMappingURL=\S*")


class Popup(MacroElement):
    """A box of HTML that opens when its parent is clicked; folium's own needs jQuery."""

    _template = Template(
        "{% macro script(this, kwargs) %}"
        "{{ this._parent.get_name() }}.bindPopup({{ this.content|tojson }}, {maxWidth: 420});"
        "{% endmacro %}"
    )

    def __init__(self, content: str) -> None:
        super().__init__()
        self._name = "Popup"
        self.content = content


class Panel(MacroElement):
    """HTML in a corner of its parent, a map, with a script in which `map` is that map."""

    _template = Template(
        "{% macro html(this, kwargs) %}{{ this.content }}{% endmacro %}"
        "{% macro script(this, kwargs) %}"
        "(function(map) { {{ this.code }} })({{ this._parent.get_name() }});"
        "{% endmacro %}"
    )

    def __init__(self, content: str, code: str = "") -> None:
        super().__init__()
        self._name = "Panel"
        self.content, self.code = content, code


class _Text(Element):
    """Text as it is: Leaflet's own holds what a template would take for its own."""

    _template = Template("{{ this.text }}")

    def __init__(self, text: str) -> None:
        super().__init__()
        self._name = "Text"
        self.text = text


def empty_map() -> folium.Map:
    """A map without tiles, attribution and links to other places; Leaflet comes with `page_text`."""
    empty = folium.Map(
        location=[0, 0], tiles=None, control_scale=True, prefer_canvas=True, attribution_control=False, zoom_snap=0.25
    )
    # folium would link Leaflet, jQuery, Bootstrap and Font Awesome.
    empty.default_js, empty.default_css = [], []
    return empty


def page_text(page: folium.Map, title: str) -> str:
    """The whole HTML page of a map made by `empty_map`."""
    figure = page.get_root()
    assert isinstance(figure, Figure)
    figure.title = html.escape(title)
    folder = Path(leaflet.BASE_DIR)
    style = _PICTURE.sub(lambda found: f"url({_png_uri(folder / found[1])})", _read(folder / "leaflet.css"))
    script = _SOURCE_MAP.sub("", _read(folder / "leaflet.js"))
    figure.header.add_child(_Text(f"<style>{style}</style><script>{script}</script>"), name="leaflet")
    return figure.render()


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def _png_uri(path: Path) -> str:
    return f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}"
