"""One self-contained HTML page: text, tables and pictures, nothing loaded from a network."""

import base64
import html
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

_STYLE = """
:root { color-scheme: light dark; --line: #8884; --soft: #8882; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; margin-bottom: .2rem; } h2 { font-size: 1.2rem; margin-top: 2.2rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; width: 100%; }
th, td { padding: .3rem .6rem; text-align: right; border-bottom: 1px solid var(--line); }
th:first-child, td:first-child { text-align: left; } tr.best td { background: var(--soft); font-weight: 600; }
figure { margin: 1rem 0; } img { max-width: 100%; height: auto; display: block; border-radius: 4px; }
figcaption, .note { color: #777; font-size: .9rem; } pre { background: var(--soft); padding: .7rem; overflow-x: auto; }
"""


class Report:
    """A page that grows from top to bottom; `write` puts it into one file."""

    def __init__(self, title: str, subtitle: str = "") -> None:
        self.title = title
        self._parts = [f"<h1>{html.escape(title)}</h1>"]
        if subtitle:
            self.note(subtitle)

    def section(self, heading: str) -> None:
        self._parts.append(f"<h2>{html.escape(heading)}</h2>")

    def text(self, text: str) -> None:
        self._parts.append(f"<p>{html.escape(text)}</p>")

    def note(self, text: str) -> None:
        self._parts.append(f'<p class="note">{html.escape(text)}</p>')

    def code(self, text: str) -> None:
        self._parts.append(f"<pre>{html.escape(text)}</pre>")

    def table(self, columns: Sequence[str], rows: Sequence[Mapping[str, str]], best: str | None = None) -> None:
        """A table of ready-made strings; the row whose first column is `best` stands out."""
        head = "".join(f"<th>{html.escape(column)}</th>" for column in columns)
        body = "".join(
            f'<tr class="{"best" if row[columns[0]] == best else ""}">'
            + "".join(f"<td>{html.escape(row.get(column, ''))}</td>" for column in columns)
            + "</tr>"
            for row in rows
        )
        self._parts.append(f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>")

    def picture(self, levels: np.ndarray, caption: str) -> None:
        """A photograph, (H, W, 3) uint8, embedded as JPEG."""
        self._image(levels, caption, "JPEG", quality=88)

    def plot(self, levels: np.ndarray, caption: str) -> None:
        """A drawing, (H, W, 3) uint8, embedded as PNG."""
        self._image(levels, caption, "PNG", optimize=True)

    def _image(self, levels: np.ndarray, caption: str, kind: str, **options: object) -> None:
        buffer = io.BytesIO()
        Image.fromarray(levels).save(buffer, format=kind, **options)
        data = base64.b64encode(buffer.getvalue()).decode()
        source = f"data:image/{kind.lower()};base64,{data}"
        label = html.escape(caption)
        self._parts.append(f'<figure><img src="{source}" alt="{label}"><figcaption>{label}</figcaption></figure>')

    def write(self, path: Path) -> None:
        """Write the page to `path`."""
        path.parent.mkdir(parents=True, exist_ok=True)
        page = (
            '<!doctype html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>{html.escape(self.title)}</title><style>{_STYLE}</style></head>"
            f"<body>{''.join(self._parts)}</body></html>\n"
        )
        path.write_text(page, encoding="utf-8")
