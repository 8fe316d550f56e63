"""The notebooks as they are stored: run from top to bottom, small, and free of warnings and of one machine's paths.

That they run is what `make test` shows, by nbmake.
"""

import json
import re
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).parents[1] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
LARGEST_BYTES = 300_000
# Two folders deep and not inside a word, an address or a relative path: /home/me, C:\Users.
ABSOLUTE_PATH = re.compile(r"(?<![\w.:/~])/\w[\w.-]*/\w|\b[A-Z]:\\\w")

Notebook = dict[str, Any]


def code_cells(notebook: Notebook) -> list[dict[str, Any]]:
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def outputs(notebook: Notebook) -> list[dict[str, Any]]:
    return [output for cell in code_cells(notebook) for output in cell["outputs"]]


def joined(lines: str | list[str]) -> str:
    """Text as a notebook stores it, in one piece or line by line."""
    return lines if isinstance(lines, str) else "".join(lines)


def words(notebook: Notebook) -> str:
    """All that a reader can read, outputs included; pictures left out."""
    parts = [joined(cell["source"]) for cell in notebook["cells"]]
    for output in outputs(notebook):
        parts.append(joined(output.get("text", "")))
        parts += [joined(text) for kind, text in output.get("data", {}).items() if kind.startswith("text/")]
    return "\n".join(parts)


def faults(notebook: Notebook) -> list[str]:
    """What a stored notebook must not have."""
    found = []
    if [cell["execution_count"] for cell in code_cells(notebook)] != list(range(1, len(code_cells(notebook)) + 1)):
        found.append("not run once from top to bottom")
    found += [f"stderr: {joined(output['text'])}" for output in outputs(notebook) if output.get("name") == "stderr"]
    found += [f"error: {output['ename']}" for output in outputs(notebook) if output["output_type"] == "error"]
    found += [f"absolute path {path.group()}..." for path in ABSOLUTE_PATH.finditer(words(notebook))]
    return found


def made(text: str = "12 matches\n", count: int = 1, **output: Any) -> Notebook:
    shown = {"output_type": "stream", "name": "stdout", "text": [text]} | output
    return {"cells": [{"cell_type": "code", "execution_count": count, "source": ["f()"], "outputs": [shown]}]}


@pytest.mark.parametrize(
    ("notebook", "fault"),
    [
        (made(), None),
        (made("see ../results/a.md and https://example.org/a/b, 1/4 m/px\n"), None),
        (made("/home/me/diffnav/a.py:1\n"), "absolute path"),
        (made('File "/usr/lib/x.py"\n'), "absolute path"),
        (made("C:\\Users\\me\n"), "absolute path"),
        (made("UserWarning: old\n", name="stderr"), "stderr"),
        (made(output_type="error", ename="ValueError"), "error: ValueError"),
        (made(count=7), "top to bottom"),
    ],
)
def test_a_fault_is_found(notebook: Notebook, fault: str | None) -> None:
    found = faults(notebook)
    assert len(found) == (fault is not None)
    assert fault is None or fault in found[0]


def test_there_are_five() -> None:
    assert [path.name[:2] for path in NOTEBOOKS] == ["1_", "2_", "3_", "4_", "5_"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_each_is_stored_as_it_should_be(path: Path) -> None:
    assert path.stat().st_size <= LARGEST_BYTES
    notebook = json.loads(path.read_text())
    assert faults(notebook) == []
    pictures = [output for output in outputs(notebook) if any("image" in kind for kind in output.get("data", {}))]
    assert pictures


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_each_uses_the_public_side_and_downloads_nothing(path: Path) -> None:
    code = "\n".join(joined(cell["source"]) for cell in code_cells(json.loads(path.read_text())))
    assert "diffnav" in code
    assert re.findall(r"(?:\.|import |, )_\w+", code) == []
    assert re.findall(r"https?://|\.\./|shared", code) == []


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_link_leads_to_a_file(path: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", words(json.loads(path.read_text()))):
        assert (FOLDER / target).exists(), target
