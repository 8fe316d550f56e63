"""Whether enhancement gains matches, told by how dark a picture is as a whole.

Enhancing a picture that is bright enough costs matches: by day more than half of them. When it pays is told by the
log-average level, the geometric mean that photographers call the key of a scene (Reinhard et al. 2002): dark parts,
whose detail 8 bit destroy, weigh most in it; unlike the definition, noise and flat scenes hardly move it. Tried beside
it: mean, quantiles and spread of the levels, shares of dark pixels, entropy, definition at several scales and in cells,
alone and up to eight together in logistic regressions. Some lose up to 1 % fewer matches on photographs like those that
they were fitted on; on drone photos of other cameras none loses clearly fewer, and most lose more.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from kornia.color import rgb_to_grayscale
from torch import Tensor

from diffnav.errors import UserError
from diffnav.navigation.gates.threshold import gap_middles

# Levels in 0..255 below which a pixel holds nothing: black borders of a turned picture tell nothing of the light.
_EMPTY = 0.5
# Above every level: such a gate enhances always.
_ALWAYS = 256.0


@dataclass(frozen=True)
class FittedBenefit:
    """A split of log-average levels, enhanced below `threshold`, and how it errs.

    missed: of the pictures that enhancement helps, the share passed through. harmed: of those that it does not help,
    the share enhanced. matches: correct ones, mean of a picture, by policy: `never` and `always` enhanced, by the
    `definition` gate, by this one (`benefit`), and `best`, if each picture's own answer were known. count: pictures.
    """

    threshold: float
    missed: float
    harmed: float
    matches: dict[str, float]
    count: int


def log_average_level(image: Tensor) -> float:
    """The geometric mean of 1 + the grey levels, less 1, of a picture (3, H, W) in [0, 1]: 0 to 255.

    Pixels that are wholly black do not count; 0 if there are no others.
    """
    grey = 255 * rgb_to_grayscale(image[None])[0, 0]
    shown = grey[grey >= _EMPTY]
    return torch.expm1(torch.log1p(shown.double()).mean()).item() if len(shown) else 0.0


def fit_benefit_threshold(
    levels: Sequence[float], matches_as_taken: Sequence[float], matches_enhanced: Sequence[float]
) -> float:
    """The log-average level below which enhancing gains the most matches in all, midway between two pictures' levels.

    Of equally good splits the one in the widest gap is taken, of equally wide gaps the lowest. 0, never, or 256,
    always, where no split gains more. Raises: UserError without pictures.
    """
    level, gains = np.asarray(levels, np.float64), np.subtract(matches_enhanced, matches_as_taken).astype(np.float64)
    if not level.size:
        raise UserError("the gate cannot be fitted without pictures; give some taken by day")
    splits, gaps = gap_middles(level)
    splits, gaps = np.concatenate([[0, _ALWAYS], splits]), np.concatenate([[np.inf, np.inf], gaps])
    gained = np.array([gains[level < split].sum() for split in splits])
    return float(splits[np.argmax(np.where(gained >= gained.max() - 1e-9, gaps, -1))])


def judge_benefit(
    threshold: float,
    levels: Sequence[float],
    matches_as_taken: Sequence[float],
    matches_enhanced: Sequence[float],
    definition_enhances: Sequence[bool],
) -> FittedBenefit:
    """How a threshold errs on pictures, and the matches it keeps beside those of the other policies.

    definition_enhances: what the definition gate says to each.
    """
    taken, enhanced = np.asarray(matches_as_taken, np.float64), np.asarray(matches_enhanced, np.float64)
    enhances, helped = np.asarray(levels) < threshold, enhanced > taken
    policies = {
        "never": taken,
        "always": enhanced,
        "definition": np.where(definition_enhances, enhanced, taken),
        "benefit": np.where(enhances, enhanced, taken),
        "best": np.maximum(taken, enhanced),
    }
    return FittedBenefit(
        threshold=threshold,
        missed=float((~enhances[helped]).mean()) if helped.any() else 0.0,
        harmed=float(enhances[~helped].mean()) if (~helped).any() else 0.0,
        matches={name: float(counts.mean()) for name, counts in policies.items()},
        count=len(taken),
    )
