"""Recipes over their seeds: hand-made figures, whose differences and gaps can be told by heart."""

import pytest

from diffnav.errors import UserError
from diffnav.evaluation.seeds import require_controls, seed_rows, seed_sections

VALUES = {
    "gamma_blind": {"p": 10.0, "q": 20.0, "r": 0.0},
    "normal": {"p": 30.0, "q": 40.0, "r": 0.0},
    "m0": {"p": 20.0, "q": 34.0},
    "m1": {"p": 22.0, "q": 32.0},
    "c0": {"p": 16.0, "q": 30.0},
    "c1": {"p": 18.0, "q": 32.0},
}
GROUPS = {"matcher": ["m0", "m1"], "control": ["c0", "c1"]}
CONTROLS = {"matcher": "control"}


def test_means_differences_and_gaps_are_those_of_the_pictures_that_all_have() -> None:
    matcher, control = seed_rows(VALUES, GROUPS, CONTROLS)
    assert (matcher["group"], matcher["seeds"], matcher["n"]) == ("matcher", 2, 2)
    # Means over seeds: p 21, q 33 against p 17, q 31.
    assert (matcher["mean"], control["mean"]) == (27, 24)
    assert matcher["difference"][0] == 3
    assert 2 <= matcher["difference"][1] <= 3 <= matcher["difference"][2] <= 4
    assert matcher["percent"] == 12.5
    assert matcher["per_seed"] == [4, 2]
    # gamma_blind has 15 there, daylight 35.
    assert matcher["gap_closed"] == pytest.approx(0.6)
    assert control["gap_closed"] == pytest.approx(0.45)
    assert control["difference"] is None


def test_without_the_ends_there_is_no_gap() -> None:
    values = {name: own for name, own in VALUES.items() if name != "normal"}
    assert seed_rows(values, GROUPS, {})[0]["gap_closed"] is None


def test_a_control_without_a_match_has_no_percentage() -> None:
    (row, _) = seed_rows({"a": {"p": 2.0}, "b": {"p": 0.0}}, {"a": ["a"], "b": ["b"]}, {"a": "b"})
    assert (row["difference"][0], row["percent"]) == (2, None)


def test_the_page_says_it() -> None:
    heading, _, matcher, table = seed_sections({"sift": seed_rows(VALUES, GROUPS, CONTROLS)})
    assert heading.startswith("## ")
    assert matcher == "### sift"
    cells = [cell.strip() for cell in table.splitlines()[2].strip("|").split("|")]
    assert cells[0] == "matcher"
    assert cells[3:5] == ["60%", "control"]
    assert cells[6:] == ["+12.5", "+4.0, +2.0", "2"]
    assert seed_sections({}) == []


@pytest.mark.parametrize(
    ("controls", "words"),
    [({"matcher": "other"}, "controls names other"), ({"matcher": "short"}, "matcher has 2 seeds and its control")],
)
def test_mistakes_are_one_sentence(controls: dict, words: str) -> None:
    with pytest.raises(UserError, match=words):
        require_controls({**GROUPS, "short": ["c0"]}, controls)
