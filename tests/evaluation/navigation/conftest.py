"""The command eval.navigation on a small site."""

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from small_site import Site, bounds, quoted

from eval.navigation import main

Locate = Callable[..., str]


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Site:
    return Site(tmp_path_factory.mktemp("site, day=1"))


@pytest.fixture(scope="session")
def shared_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Features of the map are found once for all tests."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def locate(
    site: Site, shared_cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Locate:
    """Run the command in this process on the site's map and photos, results in tmp_path/out; what it prints."""

    def run(*arguments: str, **settings: Any) -> str:
        plain = {
            "map": quoted(site.map),
            "maps.bounds": bounds(),
            "queries": quoted(site.photos),
            "always": "[input]",
            "checkpoint": "[]",
            "features": 300,
            "tiles.features": 600,
            "tiles.size": "[200,280]",
            "out": tmp_path / "out",
            "paths.runs": tmp_path / "runs",
            "cache": shared_cache,
            "workers": 1,
            "device": "cpu",
        }
        given = {key.replace("__", "."): value for key, value in settings.items()}
        chosen = {key: value for key, value in (plain | given).items() if value is not ...}
        monkeypatch.setattr(sys, "argv", ["eval.navigation", *(f"{k}={v}" for k, v in chosen.items()), *arguments])
        main()
        return capsys.readouterr().out

    return run


@pytest.fixture
def mistake(locate: Locate, refusal: Callable[..., str]) -> Locate:
    """Run the command, which must end with exit code 2; its sentence."""
    return partial(refusal, locate)
