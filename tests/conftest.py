"""What all tests share: repeatable property tests (`make test-all` draws new examples), and a refused command."""

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import settings

settings.register_profile("repeatable", derandomize=True)
settings.load_profile("repeatable")


@pytest.fixture
def refusal(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Run a command's `main` by whatever calls it, which must end with exit code 2; its one sentence."""

    def run(command: Callable[..., Any], *arguments: str, **settings: Any) -> str:
        with pytest.raises(SystemExit) as left:
            command(*arguments, **settings)
        assert left.value.code == 2
        error = capsys.readouterr().err.replace("\r", "\n")
        assert "Traceback" not in error
        (sentence,) = [line for line in error.splitlines() if line.startswith("error: ")]
        assert error.rstrip().endswith(sentence)
        return sentence

    return run
