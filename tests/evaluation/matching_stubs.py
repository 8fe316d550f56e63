"""What the tests of the matching experiment share: small photos, a matcher with known matches, a counting enhancer."""

from collections.abc import Sequence
from functools import partial

import torch
from torch import Tensor, nn

from diffnav.darkness import Darkening, DarknessModel
from diffnav.data.match_pairs.rot180 import Rot180Pairs
from diffnav.data.pair_source import PairSource
from diffnav.data.photos import Photo
from diffnav.evaluation.contest import Contest, NamedMatcher
from diffnav.evaluation.methods import Method
from diffnav.evaluation.predictions import PredictionCache
from diffnav.matching.matches import Features, Matches
from diffnav.matching.verification import verify

SIZE = (64, 80)


def picture(seed: int, size: tuple[int, int] = SIZE) -> Tensor:
    """(3, h, w), sides multiples of 8: blocks and noise, different for every seed."""
    dice = torch.Generator().manual_seed(seed)
    blocks = torch.rand(3, size[0] // 8, size[1] // 8, generator=dice).repeat_interleave(8, 1).repeat_interleave(8, 2)
    return (0.3 + 0.7 * blocks + 0.1 * torch.rand(3, *size, generator=dice)).clamp(0, 1)


def photos(count: int = 3, first: int = 0) -> list[Photo]:
    """p0 of site_0, p1 of site_1, p2 of site_0, ..."""
    return [Photo(f"p{k}", f"site_{k % 2}", partial(picture, k)) for k in range(first, first + count)]


def turned(count: int = 3, seed: int = 0) -> list[tuple[Rot180Pairs, Photo]]:
    """Jobs: rotated pairs of `photos`."""
    pairs = Rot180Pairs(PairSource(photos(count), DarknessModel(), seed))
    return [(pairs, photo) for photo in pairs.photos]


class KnownMatcher:
    """Ten keypoints in every picture; in one turned by half the first `right` of `count` match where they should.

    The other matches go `error_px` too far. Its calls are counted.
    """

    name = "known"

    def __init__(self, right: int = 8, error_px: float = 5.0, count: int = 10, fails: bool = False) -> None:
        self.settings = {"right": right, "error_px": error_px, "count": count}
        self.fails = fails
        self.detected: list[float] = []
        self.matched = 0

    def features(self, image: Tensor) -> Features:
        self.detected.append(image.mean().item())
        x = torch.tensor([10.0, 70, 12, 66, 30, 50, 20, 60, 40, 44])
        y = torch.tensor([8.0, 10, 50, 55, 20, 40, 33, 27, 44, 12])
        return Features(torch.stack([x, y], 1), torch.zeros(10, 2), torch.ones(10), SIZE)

    def match(self, a: Features, b: Features) -> Matches:  # noqa: ARG002
        self.matched += 1
        if self.fails:
            raise ValueError("no memory  left")
        points_b = torch.tensor([SIZE[1] - 1, SIZE[0] - 1]) - a.keypoints
        points_b[self.settings["right"] :, 0] += self.settings["error_px"]
        count = self.settings["count"]
        return Matches(a.keypoints[:count], points_b[:count], torch.ones(count), self.name, self.settings)


class Brighten(nn.Module):
    """Raises to a power; counts its calls; fails on pictures of one mean."""

    def __init__(self, power: float = 0.5, fails: bool = False) -> None:
        super().__init__()
        self.power = nn.Parameter(torch.tensor(power), requires_grad=False)
        self.fails = fails
        self.calls = 0

    def forward(self, image: Tensor, record: Sequence[Darkening] | None = None) -> Tensor:  # noqa: ARG002
        self.calls += 1
        if self.fails:
            raise RuntimeError("out of memory")
        return image**self.power


def contest(
    enhancers: dict[str, nn.Module], matchers: dict[str, object], cache: PredictionCache | None = None, **settings
) -> Contest:
    methods = [Method(name, enhancer.eval(), {}) for name, enhancer in enhancers.items()]
    named = [NamedMatcher(name, matcher) for name, matcher in matchers.items()]
    return Contest(methods, named, partial(verify, **settings), settings, cache or PredictionCache(None))
