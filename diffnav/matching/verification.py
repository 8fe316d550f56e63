"""Which matches one geometric model explains: MAGSAC++ (Barath et al. 2020), by OpenCV's USAC."""

import math
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.matching.matches import Matches

Kind = Literal["homography", "fundamental"]

# Matches that fix the model, and OpenCV's MAGSAC preset: matches and rounds of the local optimisation.
_PRESETS = {"homography": (4, 75, 15), "fundamental": (8, 50, 10)}
# Singular values below this share of the largest are rounding: points are float32.
_RANK_TOLERANCE = 1e-5
# OpenCV counts in 32 bit.
_LARGEST = 2**31 - 1


@dataclass(frozen=True)
class Verification:
    """What verification found.

    model: (3, 3) float64, None without one. Homography: H_a_b with H[2, 2] = 1 unless it vanishes. Fundamental: F
    with b^T F a = 0 for columns (x, y, 1). inliers: (M,) bool, none without a model. Within the threshold of a
    homography: the distance in b; of a fundamental matrix: the Sampson distance.
    """

    model: Tensor | None
    inliers: Tensor


def verify(
    matches: Matches,
    model: Kind = "homography",
    threshold_px: float = 3.0,
    confidence: float = 0.999,
    iterations: int = 10_000,
    seed: int = 0,
) -> Verification:
    """The model that explains most of the matches, and which: a pure function of its arguments.

    Args:
        threshold_px: error at which a match stops being an inlier. confidence: probability with which a sample of
            inliers alone shall have been drawn, after which the search ends. iterations: samples at most.
        seed: of the samples.
    Returns: no model for too few matches (4; 8 for a fundamental matrix, which any 7 fit) and where the inliers
        leave it open: too few different ones, all but one on a line, for a fundamental matrix all in one plane.
        That is told by exact positions: noise of a tenth of a pixel makes a line or a plane determine something.
    Raises: UserError for a setting out of range.
    """
    _require_settings(model, threshold_px, confidence, iterations, seed)
    nothing = Verification(None, torch.zeros(len(matches), dtype=torch.bool))
    if len(matches) < _PRESETS[model][0]:
        return nothing
    points_a, points_b = (points.double().numpy() for points in (matches.points_a, matches.points_b))
    solve = cv2.findHomography if model == "homography" else cv2.findFundamentalMat
    try:
        found, mask = solve(points_a, points_b, _usac(model, threshold_px, confidence, iterations, seed))
    except cv2.error:
        # Its refinement of a fundamental matrix fails where all but two or so of the matches lie in one plane.
        return nothing
    if found is None or mask is None:
        return nothing
    inliers = mask.ravel() > 0
    if not np.isfinite(found).all() or not _is_determined(model, points_a[inliers], points_b[inliers]):
        return nothing
    return Verification(torch.from_numpy(found), torch.from_numpy(inliers))


def _usac(model: Kind, threshold_px: float, confidence: float, iterations: int, seed: int) -> cv2.UsacParams:
    """OpenCV's own settings for USAC_MAGSAC, with a seed, which its flag does not take."""
    params = cv2.UsacParams()
    params.sampler = cv2.SAMPLING_UNIFORM
    params.score = cv2.SCORE_METHOD_MAGSAC
    params.loMethod = cv2.LOCAL_OPTIM_SIGMA
    _, params.loSampleSize, params.loIterations = _PRESETS[model]
    params.threshold = threshold_px
    params.confidence = confidence
    params.maxIterations = iterations
    params.randomGeneratorState = seed
    return params


def _is_determined(model: Kind, points_a: np.ndarray, points_b: np.ndarray) -> bool:
    """Whether the points (M, 2), (M, 2) leave no choice of the model: rank 8 of its linear equations.

    A homography onto a line satisfies its equations too, so b must also have points off any line.
    """
    if len(points_a) == 0:
        return False
    a, b = _normalised(points_a), _normalised(points_b)
    if model == "fundamental":
        equations = np.einsum("mi,mj->mij", b, a).reshape(-1, 9)
    else:
        u, v, nothing = b[:, :1], b[:, 1:2], np.zeros_like(a)
        equations = np.concatenate([np.hstack([a, nothing, -u * a]), np.hstack([nothing, a, -v * a])])
    return _rank(equations) >= 8 and _rank(b) == 3


def _normalised(points: np.ndarray) -> np.ndarray:
    """Columns (x, y, 1) of the points (M, 2), shifted and scaled to mean 0 and variance 1 (Hartley 1997)."""
    centred = points - points.mean(0)
    spread = np.sqrt((centred**2).mean())
    return np.hstack([centred / max(spread, np.finfo(float).tiny), np.ones((len(points), 1))])


def _rank(matrix: np.ndarray) -> int:
    singular = np.linalg.svd(matrix, compute_uv=False)
    return int((singular > _RANK_TOLERANCE * singular[0]).sum())


def _require_settings(model: str, threshold_px: float, confidence: float, iterations: int, seed: int) -> None:
    if model not in _PRESETS:
        raise UserError(f"verification.model must be homography or fundamental, got {model!r}")
    if not 0 < threshold_px < math.inf:
        raise UserError(f"verification.threshold_px must be above 0, got {threshold_px}")
    if not 0 < confidence < 1:
        raise UserError(f"verification.confidence must be above 0 and below 1, got {confidence}")
    if not isinstance(iterations, int) or not 1 <= iterations <= _LARGEST:
        raise UserError(f"verification.iterations must be a whole number, 1 or more, got {iterations}")
    if not isinstance(seed, int) or not 0 <= seed <= _LARGEST:
        raise UserError(f"verification.seed must be a whole number from 0 to {_LARGEST}, got {seed}")
