"""What `import diffnav` gives, and what it does not load."""

import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

import diffnav
from diffnav.checkpoints import load_enhancer

ROOT = Path(diffnav.__file__).parents[1]


def test_the_door_is_the_function() -> None:
    assert diffnav.load_enhancer is load_enhancer
    assert set(diffnav.__all__) == {"__version__", "load_enhancer"}
    with pytest.raises(AttributeError, match="load_enhancers"):
        _ = diffnav.load_enhancers  # type: ignore[attr-defined]


def test_importing_the_package_loads_nothing_heavy() -> None:
    code = "import sys, diffnav; print([m for m in ('torch', 'cv2', 'kornia', 'matplotlib') if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert result.stdout.strip() == "[]"


def test_the_version_has_one_home() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert "version" in project["project"]["dynamic"]
    assert project["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "diffnav.__version__"}
    assert metadata.version("diffnav") == diffnav.__version__
