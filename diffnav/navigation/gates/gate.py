"""Gates: whether a picture is enhanced before it is matched."""

import math
from dataclasses import dataclass
from typing import Protocol

from torch import Tensor

from diffnav.errors import UserError
from diffnav.navigation.gates.benefit import log_average_level
from diffnav.navigation.gates.definition import definition

Decision = tuple[bool, dict[str, float]]


class Gate(Protocol):
    """What a localizer asks before it matches a picture."""

    def enhances(self, image: Tensor) -> Decision:
        """Whether to enhance a picture (3, H, W) in [0, 1], and what was measured, by name: `definition` always."""
        ...


@dataclass(frozen=True)
class Never:
    """Every picture is matched as it was taken."""

    def enhances(self, image: Tensor) -> Decision:
        return False, {"definition": definition(image).item()}


@dataclass(frozen=True)
class Always:
    """Every picture is enhanced."""

    def enhances(self, image: Tensor) -> Decision:
        return True, {"definition": definition(image).item()}


@dataclass(frozen=True)
class DefinitionGate:
    """The paper's: a picture is dark, and enhanced, if its definition (Eq. 10, per pixel) lies below `threshold`."""

    threshold: float

    def __post_init__(self) -> None:
        _require_level(self.threshold)

    def enhances(self, image: Tensor) -> Decision:
        measured = definition(image).item()
        return measured < self.threshold, {"definition": measured}


@dataclass(frozen=True)
class BenefitGate:
    """Enhances where that gains matches: if the log-average level (0..255) lies below `threshold`."""

    threshold: float

    def __post_init__(self) -> None:
        _require_level(self.threshold)

    def enhances(self, image: Tensor) -> Decision:
        level = log_average_level(image)
        return level < self.threshold, {"definition": definition(image).item(), "log_average_level": level}


def _require_level(threshold: float) -> None:
    if isinstance(threshold, bool) or not isinstance(threshold, int | float) or not 0 <= threshold < math.inf:
        raise UserError(f"gate.threshold must be a number, 0 or more, got {threshold}")
