"""Trees of small pictures, as data sets are unpacked."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image


@pytest.fixture
def grow(tmp_path: Path) -> Callable[..., Path]:
    """Make pictures of 6 x 4 pixels at these paths below a folder with a blank in its name."""
    root = tmp_path / "my data"

    def make(*paths: str) -> Path:
        for path in paths:
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            Image.fromarray(np.full((4, 6, 3), 9, np.uint8)).save(root / path)
        return root

    return make


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str, str], Path]:
    """Write a text file below the same folder."""

    def make(path: str, text: str) -> Path:
        file = tmp_path / "my data" / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        return file

    return make
