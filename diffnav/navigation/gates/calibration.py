"""Both gates fitted on pictures, and stored as JSON with their error rates."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from diffnav.errors import UserError
from diffnav.navigation.gates.benefit import FittedBenefit, fit_benefit_threshold, judge_benefit
from diffnav.navigation.gates.gate import Always, BenefitGate, DefinitionGate, Gate, Never
from diffnav.navigation.gates.samples import GateSample
from diffnav.navigation.gates.threshold import FittedThreshold, fit_threshold, judge_threshold
from diffnav.navigation.text_file import write_text

GateName = Literal["never", "always", "definition", "benefit"]


@dataclass(frozen=True)
class Calibration:
    """Both gates' thresholds with their errors.

    fitted_on: plain values that say on what: pictures, seed, enhancer, matchers. validation: how the same thresholds
    err on pictures that they were not fitted on, where there are some.
    """

    definition: FittedThreshold
    benefit: FittedBenefit
    fitted_on: dict[str, Any] = field(default_factory=dict)
    validation: dict[str, Any] | None = None

    def gate(self, name: GateName) -> Gate:
        """The gate of that name. Raises: UserError for another name."""
        gates: dict[str, Gate] = {
            "never": Never(),
            "always": Always(),
            "definition": DefinitionGate(self.definition.threshold),
            "benefit": BenefitGate(self.benefit.threshold),
        }
        if name not in gates:
            raise UserError(f"gate must be one of {', '.join(gates)}, got {name}")
        return gates[name]


def fit_gates(samples: Sequence[GateSample], fitted_on: dict[str, Any] | None = None) -> Calibration:
    """Both thresholds, fitted on `samples`, and how they err there.

    Raises: UserError if there is none, or definition does not tell the dark pictures from the normal ones.
    """
    normal, dark = [s.definition_normal for s in samples], [s.definition_dark for s in samples]
    level = fit_benefit_threshold(
        [s.log_average_level for s in samples],
        [s.matches_as_taken for s in samples],
        [s.matches_enhanced for s in samples],
    )
    return judge_gates(fit_threshold(normal, dark).threshold, level, samples, fitted_on)


def judge_gates(
    definition: float, level: float, samples: Sequence[GateSample], fitted_on: dict[str, Any] | None = None
) -> Calibration:
    """How given thresholds of both gates err on `samples`. Raises: UserError if there is none."""
    return Calibration(
        definition=judge_threshold(
            definition, [s.definition_normal for s in samples], [s.definition_dark for s in samples]
        ),
        benefit=judge_benefit(
            level,
            [s.log_average_level for s in samples],
            [s.matches_as_taken for s in samples],
            [s.matches_enhanced for s in samples],
            [s.definition < definition for s in samples],
        ),
        fitted_on=fitted_on or {},
    )


def write_gates(path: Path, calibration: Calibration) -> None:
    """Write a calibration as JSON, whole or not at all. Raises: UserError if the file cannot be written."""
    write_text(Path(path), json.dumps(asdict(calibration), indent=1, allow_nan=False) + "\n")


def read_gates(path: str | Path) -> Calibration:
    """The calibration in a file of `write_gates`. Raises: UserError if it is missing or none."""
    try:
        content = json.loads(Path(path).expanduser().read_text(encoding="utf-8"))
        return Calibration(
            definition=FittedThreshold(**content["definition"]),
            benefit=FittedBenefit(**content["benefit"]),
            fitted_on=dict(content["fitted_on"]),
            validation=content["validation"],
        )
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}); calibrate the gates first") from None
    except (ValueError, KeyError, TypeError):
        raise UserError(f"{path}: not a calibration of the gates; write it anew with calibrate=FOLDER") from None


def shipped_gates() -> Calibration:
    """The calibration inside the package: for aerial photographs and the enhancer compact_joint."""
    return read_gates(str(resources.files("diffnav") / "navigation" / "gates" / "shipped.json"))
