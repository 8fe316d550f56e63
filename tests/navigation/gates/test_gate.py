import pytest
import torch

from diffnav.errors import UserError
from diffnav.navigation.gates.gate import Always, BenefitGate, DefinitionGate, Never

# One pixel of 100 on a background of 20: a definition of 8 * 80 / 100, a log-average level of 21 (101 / 21)^.01 - 1.
IMAGE = torch.full((3, 10, 10), 20 / 255)
IMAGE[:, 5, 5] = 100 / 255


def test_never_and_always_measure_the_definition_too():
    for gate, answer in ((Never(), False), (Always(), True)):
        enhances, measured = gate.enhances(IMAGE)
        assert enhances is answer
        assert measured["definition"] == pytest.approx(6.4, rel=1e-4)


@pytest.mark.parametrize(("threshold", "answer"), [(6.3, False), (6.5, True), (0, False)])
def test_the_definition_gate_enhances_what_lies_below(threshold, answer):
    enhances, measured = DefinitionGate(threshold).enhances(IMAGE)
    assert enhances is answer
    assert measured == {"definition": pytest.approx(6.4, rel=1e-4)}


@pytest.mark.parametrize(("threshold", "answer"), [(20.3, False), (20.4, True), (0, False), (256, True)])
def test_the_benefit_gate_enhances_dark_pictures(threshold, answer):
    enhances, measured = BenefitGate(threshold).enhances(IMAGE)
    assert enhances is answer
    assert measured == {
        "definition": pytest.approx(6.4, rel=1e-4),
        "log_average_level": pytest.approx(20.3325, abs=1e-3),
    }


@pytest.mark.parametrize("gate", [DefinitionGate, BenefitGate])
@pytest.mark.parametrize("threshold", [-1, float("nan"), float("inf"), "3", None, True])
def test_thresholds_out_of_range_are_named(gate, threshold):
    with pytest.raises(UserError, match=r"gate\.threshold must be a number"):
        gate(threshold)
