"""What every matcher takes and gives: `Features` of one image, `Matches` between two, and the `Matcher` interface."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from torch import Tensor


@dataclass(frozen=True)
class Features:
    """Keypoints of one image, the strongest first.

    keypoints: (N, 2) float32 x, y in pixels; a position comes once per descriptor (a corner may have several
    orientations). descriptors: (N, D) float32, or uint8 of 8 bits each if binary. scores: (N,) float32, the
    detector's response. size: (h, w).
    image: the picture itself, (3, h, w), where a matcher without keypoints needs it; its N is 0.
    """

    keypoints: Tensor
    descriptors: Tensor
    scores: Tensor
    size: tuple[int, int]
    image: Tensor | None = None

    def __len__(self) -> int:
        return len(self.keypoints)


@dataclass(frozen=True)
class Matches:
    """Pairs of points between images a and b; no two of them share a pixel of a or of b.

    points_a, points_b: (M, 2) float32 x, y in pixels. confidence: (M,) float32 in [0, 1], the matcher's own.
    matcher, settings: who made them, and how.
    """

    points_a: Tensor
    points_b: Tensor
    confidence: Tensor
    matcher: str
    settings: Mapping[str, Any]

    def __len__(self) -> int:
        return len(self.points_a)


class Matcher(Protocol):
    """A way to match two images in two steps, so that features of a map tile are found once for all queries.

    name: of its file and YAML. settings: the constructor's arguments, as plain values.
    """

    name: str
    settings: Mapping[str, Any]

    def features(self, image: Tensor) -> Features:
        """The features of an image (3, H, W) in [0, 1]; none at all (N = 0) is an answer, not an error."""
        ...

    def match(self, a: Features, b: Features) -> Matches:
        """The matches between two images' features, perhaps none."""
        ...
