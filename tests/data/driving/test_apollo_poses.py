"""ApolloScape's pose files in both forms, and the times in its names."""

import pytest

from diffnav.data.driving.apollo import apollo_time_s
from diffnav.data.driving.poses import apollo_positions
from diffnav.errors import UserError


def test_both_forms_may_mix_with_blank_lines(write) -> None:
    file = write("pose.txt", "\na.jpg 1,2,3,4,5,6\n1 0 0 7 0 1 0 8 0 0 1 9 0 0 0 1 b c.jpg\n")
    assert apollo_positions(file) == {"a": (4, 5, 6), "b c": (7, 8, 9)}


@pytest.mark.parametrize("line", ["a.jpg 1,2,3,4,5", "a.jpg", "1 2 3 4", "1,2,3,4,5,6", "a.jpg 1,2,3,x,5,6"])
def test_a_damaged_line_is_named(line: str, write) -> None:
    file = write("pose.txt", f"a.jpg 1,2,3,4,5,6\n{line}\n")
    with pytest.raises(UserError, match=r"pose\.txt line 2: n"):
        apollo_positions(file)


def test_times_are_utc_to_the_millisecond() -> None:
    # 2017-04-27 is day 17283 since 1970.
    assert apollo_time_s("170427_222949943") == pytest.approx(17283 * 86400 + 22 * 3600 + 29 * 60 + 49.943, abs=1e-6)
    assert apollo_time_s("170427_259949943") is None
    assert apollo_time_s("17_2") is None
