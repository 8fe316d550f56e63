"""The API reference builds without a warning, and leaves out no module, command or choice."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
pytest.importorskip("mkdocstrings_handlers.python", reason="the extra `docs` is not installed")


def helper(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_module_is_on_one_page():
    pages = helper("pages")
    listed = [name for page in ["diffnav", *pages.FOLDERS] for name in pages.modules(page)]
    paths = [path for path in (ROOT / "diffnav").rglob("*.py") if path.read_text().strip()]
    dotted = [".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for path in paths]
    assert sorted(listed) == sorted(dotted)


def test_every_command_and_choice_is_shown_with_its_settings():
    pages = helper("pages")
    commands, configuration = pages.commands_page(), pages.configuration_page()
    doors = [path for path in [*ROOT.glob("eval/*.py"), *ROOT.glob("train/*.py")] if "@command(" in path.read_text()]
    for path in doors:
        assert f"## python -m {path.parent.name}.{path.stem}\n" in commands
    assert "checkpoint: compact_joint # name of one that ships, a weights file, or a run's folder" in commands
    for path in ROOT.glob("conf/*/*.yaml"):
        assert f"### {path.parent.name}={path.stem}\n\n```yaml\n{path.read_text().strip()}\n```" in configuration


def test_the_index_is_the_readme_and_links_to_what_is_there_alone():
    pages = helper("pages")
    index = pages.index_page()
    links = re.findall(r"\]\(([^)]+)\)", index)
    assert links
    assert set(links) <= set(pages.readme_pictures())
    assert all((ROOT / picture).is_file() for picture in links)
    assert "`notebooks/3_gradients_through_a_homography.ipynb`" in index


def test_arguments_that_share_a_line_are_listed_by_themselves():
    written = (
        "Sum of a, b: c.\n\nArgs:\n    a, b: (N,) of\n        both.\n    c: one.\nRaises: ValueError if a, b: differ."
    )
    read = helper("docstrings").one_line_each(written)
    assert read == (
        "Sum of a, b: c.\n\nArgs:\n    a: (N,) of\n        both.\n    b: (N,) of\n        both.\n    c: one.\n"
        "Raises: ValueError if a, b: differ."
    )


def test_short_notes_are_paragraphs():
    read = helper("docstrings").notes_apart("Half of a.\n\nArgs: a in m.\nReturns: m.\n\nArgs:\n    a: m.")
    assert read == "Half of a.\n\n\n**Args:** a in m.\n\n**Returns:** m.\n\nArgs:\n    a: m."


@pytest.mark.slow
def test_it_builds_without_a_warning_and_fetches_nothing(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")],
        cwd=ROOT, capture_output=True, text=True, timeout=900,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "WARNING -" not in done.stderr
    matching = (tmp_path / "site" / "api" / "matching.html").read_text()
    assert 'id="diffnav.matching.soft.dual_softmax"' in matching
    for page in (tmp_path / "site").rglob("*.html"):
        text = page.read_text()
        assert not re.search(r'<(?:script|img)[^>]+src="?(?:https?:)?//', text), page
        assert not re.search(r'<link[^>]+rel="?(?:stylesheet|preconnect)"?[^>]+href="?(?:https?:)?//', text), page
