import random

import pytest
import torch

from diffnav.errors import UserError
from diffnav.navigation.gates.benefit import fit_benefit_threshold, judge_benefit, log_average_level


def grey(levels, shape):
    return (torch.tensor(levels, dtype=torch.float32) / 255).reshape(1, *shape).expand(3, *shape)


def test_the_level_is_the_geometric_mean():
    # Of 1 + 3, 1 + 15 and 1 + 63: 16.
    assert log_average_level(grey([3, 15, 63], (1, 3))) == pytest.approx(15, abs=1e-3)
    assert log_average_level(grey([200], (1, 1))) == pytest.approx(200, abs=1e-3)
    red = torch.tensor([1.0, 0.0, 0.0])[:, None, None].expand(3, 4, 4)
    assert log_average_level(red) == pytest.approx(0.299 * 255, abs=1e-2)


def test_black_borders_do_not_count():
    image = grey(list(range(20, 120)), (10, 10))
    framed = torch.nn.functional.pad(image, (20, 20, 20, 20))
    assert log_average_level(framed) == pytest.approx(log_average_level(image))
    assert log_average_level(torch.zeros(3, 5, 5)) == 0


def test_noise_hardly_moves_it():
    flat = torch.full((3, 64, 64), 0.4)
    noisy = flat + 0.04 * torch.randn(3, 64, 64, generator=torch.Generator().manual_seed(0))
    assert abs(log_average_level(noisy) - log_average_level(flat)) < 1


def kept(threshold, levels, taken, enhanced):
    return sum(e if level < threshold else t for level, t, e in zip(levels, taken, enhanced, strict=True))


@pytest.mark.parametrize("seed", range(20))
def test_no_other_threshold_keeps_more_matches(seed):
    dice = random.Random(seed)
    levels = [dice.choice([dice.uniform(0, 80), dice.randint(0, 20)]) for _ in range(40)]
    taken = [dice.randint(0, 200) + 3 * level for level in levels]
    enhanced = [dice.randint(0, 400) for _ in levels]
    threshold = fit_benefit_threshold(levels, taken, enhanced)
    others = [0.0, 256.0, *(level + 1e-9 for level in levels)]
    best = max(kept(other, levels, taken, enhanced) for other in others)
    assert kept(threshold, levels, taken, enhanced) == pytest.approx(best)


def test_it_lies_midway_and_in_the_widest_gap():
    # Between 40 and 70 nothing changes: the picture at 50 gains nothing and loses nothing.
    assert fit_benefit_threshold([10, 40, 50, 70], [0, 0, 5, 100], [9, 9, 5, 0]) == 60


def test_never_and_always_are_answers():
    assert fit_benefit_threshold([10, 20], [5, 5], [1, 2]) == 0
    assert fit_benefit_threshold([10, 255], [1, 2], [5, 5]) == 256
    with pytest.raises(UserError, match="without pictures"):
        fit_benefit_threshold([], [], [])


def test_errors_and_matches_by_hand():
    judged = judge_benefit(
        30.0,
        levels=[10, 20, 25, 40, 50],
        matches_as_taken=[0, 10, 100, 20, 200],
        matches_enhanced=[50, 60, 40, 80, 100],
        definition_enhances=[True, False, False, True, True],
    )
    # Helped: the first, second and fourth; the fourth is passed. Not helped: the third, enhanced, and the fifth.
    assert judged.missed == pytest.approx(1 / 3)
    assert judged.harmed == pytest.approx(1 / 2)
    assert judged.matches == {"never": 66, "always": 66, "definition": 68, "benefit": 74, "best": 98}
    assert (judged.threshold, judged.count) == (30.0, 5)


def test_shares_of_nothing_are_zero():
    judged = judge_benefit(30.0, [10], [1], [2], [True])
    assert (judged.missed, judged.harmed) == (0, 0)
