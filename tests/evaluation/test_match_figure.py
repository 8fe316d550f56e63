import numpy as np
import pytest
import torch

from diffnav.evaluation.match_figure import GAP_PX, GREEN, RED, draw_matches
from diffnav.matching.matches import Matches

A, B = torch.full((3, 160, 160), 0.25), torch.full((3, 140, 200), 0.5)


def matches_of(count):
    """Level lines, one every 4 px from y = 40 on, from x = 20 in a to x = 30 in b."""
    y = 40 + 4.0 * torch.arange(count)
    points_a, points_b = torch.stack([y * 0 + 20, y], 1), torch.stack([y * 0 + 30, y], 1)
    return Matches(points_a, points_b, torch.linspace(0.9, 0.3, count), "by hand", {})


def coloured(drawing, colour, x):
    """The rows whose pixel in column x is of this colour, but for anti-aliasing."""
    return np.flatnonzero(np.abs(drawing[:, x].astype(int) - colour).max(-1) < 45).tolist()


def test_pictures_stand_side_by_side_unchanged():
    drawing = draw_matches(A, B, matches_of(0), torch.zeros(0, dtype=torch.bool))
    assert drawing.shape == (160, 160 + GAP_PX + 200, 3)
    assert drawing.dtype == np.uint8
    assert (drawing[30:, :160] == 64).all()
    assert (drawing[:140, 160 + GAP_PX :] == 128).all()
    assert (drawing[:, 160 : 160 + GAP_PX] == 255).all()
    assert (drawing[140:, 160:] == 255).all()


def test_lines_lead_from_point_to_point_green_if_correct_and_red_if_wrong():
    drawing = draw_matches(A, B, matches_of(4), torch.tensor([True, False, False, True]))
    for x in (21, 100, 160 + GAP_PX + 29):
        assert {40, 52} <= set(coloured(drawing, GREEN, x))
        assert {44, 48} <= set(coloured(drawing, RED, x))
    beyond = drawing[30:, :15], drawing[30:140, 160 + GAP_PX + 35 :]
    assert all((part == part[0, 0]).all() for part in beyond)


def test_of_many_matches_a_fair_share_is_drawn():
    correct = torch.arange(20) < 10
    drawing = draw_matches(A, B, matches_of(20), correct, max_lines=10)
    assert len(coloured(drawing, GREEN, 100)) == 5
    assert len(coloured(drawing, RED, 100)) == 5


def test_no_lines_can_be_asked_for():
    drawing = draw_matches(A, B, matches_of(5), torch.ones(5, dtype=torch.bool), max_lines=0)
    assert coloured(drawing, GREEN, 100) == []


def test_the_count_is_written_at_the_top_left():
    three = draw_matches(A, B, matches_of(4), torch.tensor([True, True, True, False]), max_lines=0)
    two = draw_matches(A, B, matches_of(4), torch.tensor([True, True, False, False]), max_lines=0)
    assert (three[:30, :160] > 200).any()
    changed = np.argwhere((three != two).any(-1))
    assert len(changed) > 0
    assert changed.max(0)[0] < 30


@pytest.mark.parametrize("correct", [0, 1, 5, 6])
def test_the_rarer_colour_lies_on_top(correct):
    """Six matches in one line: what shows is the colour of which there are fewer."""
    y = torch.full((6,), 60.0)
    points_a, points_b = torch.stack([y * 0 + 20, y], 1), torch.stack([y * 0 + 30, y], 1)
    matches = Matches(points_a, points_b, torch.ones(6), "by hand", {})
    drawing = draw_matches(A, B, matches, torch.arange(6) < correct)
    expected = GREEN if correct in (1, 6) else RED
    assert 60 in coloured(drawing, expected, 100)


def test_the_inputs_stay_as_they_were():
    a, b = A.clone(), B.clone()
    draw_matches(a, b, matches_of(4), torch.ones(4, dtype=torch.bool))
    assert torch.equal(a, A)
    assert torch.equal(b, B)
