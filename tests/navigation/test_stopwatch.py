"""How long stages took."""

import pytest

from diffnav.navigation import stopwatch
from diffnav.navigation.stopwatch import Stopwatch


def test_turns_of_a_stage_add_up_and_an_error_ends_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock that stands at 1, 1.5, 2, 4, 7, 7.25 seconds when asked."""
    clock = iter([1.0, 1.5, 2.0, 4.0, 7.0, 7.25])
    monkeypatch.setattr(stopwatch.time, "perf_counter", lambda: next(clock))
    watch = Stopwatch()
    with watch.stage("match"):
        pass
    with watch.stage("read"):
        pass
    with pytest.raises(ValueError, match="broken"), watch.stage("match"):
        raise ValueError("broken")
    assert watch.milliseconds == {"match": 750, "read": 2000}
