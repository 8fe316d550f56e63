"""Learning-rate schedules: the factor on the rate is a function of the step, so resuming is exact."""

import math
from dataclasses import dataclass

from diffnav.errors import UserError


@dataclass(frozen=True)
class Constant:
    """No schedule, as in the paper. A run may be resumed with more steps."""

    extendable = True

    def factor(self, step: int, steps: int) -> float:  # noqa: ARG002
        return 1.0


@dataclass(frozen=True)
class OneCycle:
    """Linear warm-up over `warmup` of all steps, then half a cosine down to `final`.

    Source: Smith & Topin 2017, in the two-phase form without momentum cycling.
    """

    warmup: float = 0.1
    final: float = 0.01
    extendable = False

    def __post_init__(self) -> None:
        for name in ("warmup", "final"):
            if not 0 <= getattr(self, name) <= 1:
                raise UserError(f"schedule.{name} must lie between 0 and 1, got {getattr(self, name)}")

    def factor(self, step: int, steps: int) -> float:
        """The factor in (0, 1] of step 0 .. steps - 1."""
        rise = max(1, round(self.warmup * steps))
        if step < rise:
            return (step + 1) / rise
        progress = (step - rise) / max(1, steps - 1 - rise)
        return self.final + (1 - self.final) * 0.5 * (1 + math.cos(math.pi * min(progress, 1.0)))
