"""The paper's loss with matcher-aware terms beside it: which terms, how strong, from which keypoints."""

from dataclasses import dataclass

from diffnav.errors import UserError
from diffnav.losses.retinex import RetinexLoss


@dataclass(frozen=True)
class HybridLoss(RetinexLoss):
    """L = w_p L_Enhance + w_s L_structure + w_m L_match + w_d L_detector + w_h L_homography.

    All but w_p are shares of gradient: a term of weight 1 pulls at the enhanced picture as hard as Eq. 7 and 8 do,
    whatever its values are. A weight of 0 leaves a term out, at no cost.

    windows: sigmas of the structure term's windows, pixels; emphasis: power of daylight's local contrast that weighs
    its places. keypoints: how many per patch at most, the strongest of
    daylight. sigmas: scales of the detector, pixels; SIFT's finest octave, of the doubled picture, has .8 to 1.6.
    temperature: of the dual softmax. h_below: the homography term joins when the running mean of the match loss falls
    below this. h_ramp: steps until it has its full weight.

    Raises: UserError if a setting is out of range.
    """

    w_p: float = 1.0
    w_s: float = 0.0
    w_m: float = 0.0
    w_d: float = 0.0
    w_h: float = 0.0
    windows: tuple[float, ...] = (1.5, 3.0, 6.0)
    emphasis: float = 0.0
    keypoints: int = 64
    sigmas: tuple[float, ...] = (0.8, 1.1, 1.6, 2.2)
    temperature: float = 0.1
    h_below: float = 3.0
    h_ramp: int = 500

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("sigmas", "windows"):
            scales = tuple(getattr(self, name))
            object.__setattr__(self, name, scales)
            if not scales or min(scales) <= 0:
                raise UserError(f"loss.{name} must be numbers above 0, got {list(scales)}")
        for name in ("w_p", "w_s", "w_m", "w_d", "w_h"):
            if getattr(self, name) < 0:
                raise UserError(f"loss.{name} must be 0 or more, got {getattr(self, name)}")
        if self.w_p == 0 and not self.matcher_aware:
            raise UserError("every weight of the loss is 0; set one of loss.w_p, w_s, w_m, w_d, w_h")
        if self.keypoints < 8:
            raise UserError(f"loss.keypoints must be 8 or more, got {self.keypoints}")
        if self.temperature <= 0:
            raise UserError(f"loss.temperature must be above 0, got {self.temperature}")
        if self.h_ramp < 1:
            raise UserError(f"loss.h_ramp must be 1 step or more, got {self.h_ramp}")

    @property
    def weights(self) -> dict[str, float]:
        """The matcher-aware terms' weights, by the terms' names."""
        return {"structure": self.w_s, "match": self.w_m, "detector": self.w_d, "homography": self.w_h}

    @property
    def matcher_aware(self) -> bool:
        """Whether any term beside the paper's has a weight."""
        return any(weight > 0 for weight in self.weights.values())

    @property
    def needs_points(self) -> bool:
        """Whether keypoints and descriptors are needed."""
        return self.w_m > 0 or self.w_h > 0
