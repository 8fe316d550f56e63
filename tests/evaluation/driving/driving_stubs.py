"""What the tests of the driving evaluation share: a tiny drive of noise, records by hand, a test of it all."""

from collections.abc import Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn.functional import avg_pool2d

from diffnav.darkness import DarknessModel
from diffnav.data.driving.driving_set import DrivingSet, Frame
from diffnav.data.driving.pairing import pair_frames
from diffnav.data.pair_source import PairSource
from diffnav.evaluation.contest import NamedMatcher
from diffnav.evaluation.driving.drive_test import DriveTest
from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.driving.references import Reference, ReferenceReader, read_references
from diffnav.evaluation.methods import Method
from diffnav.evaluation.predictions import PredictionCache
from diffnav.images import quantise, write_image
from diffnav.matching.orb_gms import OrbGms
from diffnav.matching.verification import verify

SIZE = (96, 160)
# Pixels of the strip between two frames, and between two cameras.
STEP, BASELINE = 24, 5


@cache
def strip() -> Tensor:
    """(3, 96, 800) noise at four scales: the side of a street."""
    dice = torch.Generator().manual_seed(0)
    layers = [
        avg_pool2d(torch.rand(3, 96 + 2 * r, 800 + 2 * r, generator=dice), 2 * r + 1, stride=1) * (2 * r + 1)
        for r in (1, 2, 4, 8)
    ]
    image = torch.stack(layers).sum(0)
    return quantise((image - image.min()) / (image.max() - image.min()))


def view(left: int) -> Tensor:
    """(3, 96, 160): what is seen from a place along the strip, whose lower half is near and moves twice as fast."""
    far, near = (strip()[:, :, start : start + SIZE[1]] for start in (left, 2 * left))
    return torch.cat([far[:, :48], near[:, 48:]], 1)


def noise_drive(count: int = 4, folder: Path | None = None) -> DrivingSet:
    """Pairs along the strip, 1.5 m from one to the next; rendered when read, or as files of `folder`."""
    sides: list[list[Frame]] = []
    for camera, shift in (("left", 0), ("right", BASELINE)):
        frames = []
        for k in range(count):
            picture: Any = partial(view, STEP * k + shift)
            if folder is not None:
                write_image(folder / camera / f"{k}.png", picture())
                picture = folder / camera / f"{k}.png"
            place = (1.5 * k, 0.0, 0.0)
            frames.append(Frame(f"{camera}/{k}", picture, camera, "road", str(k), position_m=place, world="road"))
        sides.append(frames)
    return pair_frames("noise", *sides, consecutive=True)


def methods(**enhancers: nn.Module) -> list[Method]:
    return [Method(name, enhancer.eval(), {}) for name, enhancer in enhancers.items()]


def gms(**settings: Any) -> NamedMatcher:
    return NamedMatcher("orb_gms", OrbGms(rotation=False, **settings))


def drive_test(
    drive: DrivingSet, rows: Sequence[Method], matchers: Sequence[NamedMatcher] | None = None, **settings: Any
) -> DriveTest:
    """The test of these rows; references are read here, without a cache."""
    matchers = matchers or [gms(threshold_factor=2.0)]
    drive, references = read_references(drive, ReferenceReader(matchers, settings.get("longest_side"), None))
    plain: dict[str, Any] = {
        "pairs": PairSource([], DarknessModel(gamma=(3, 4)), 7),
        "darkness": {"gamma": [3, 4]},
        "cache": PredictionCache(None),
        "verify": partial(verify, model="fundamental"),
        "verification": {"model": "fundamental"},
        "verified": 2,
    }
    return DriveTest(drive=drive, references=references, methods=rows, matchers=matchers, **(plain | settings))


def answers(task: DriveTest, number: int) -> list[DrivingRecord]:
    """The records that are made of one query."""
    return [record for _, record in task(number) if record]


def told(record: DrivingRecord) -> tuple:
    """A record without its times."""
    return record.method, record.matcher, record.name, record.truth, record.counts, record.inliers, record.failure


class Brighten(nn.Module):
    """Raises to a power; fails on pictures of one mean; counts its calls, over all copies of it."""

    calls = 0

    def __init__(self, power: float = 0.25, fails: bool = False) -> None:
        super().__init__()
        self.power, self.fails = nn.Parameter(torch.tensor(power), requires_grad=False), fails

    def forward(self, image: Tensor, record: object = None) -> Tensor:  # noqa: ARG002
        Brighten.calls += 1
        if self.fails:
            raise RuntimeError("out of  memory")
        return image**self.power


def hand_drive(**settings: Any) -> DrivingSet:
    """Four moments of a road at 0, 1.5, 3 and 8 m, and one of another road, far away."""
    places = [("a", k, (x, 0.0, 0.0)) for k, x in enumerate((0.0, 1.5, 3.0, 8.0))] + [("b", 0, (0.0, 0.0, 0.0))]
    sides = [
        [
            Frame(f"{camera}/{road}{k}", Path(f"{camera}/{road}{k}.png"), camera, road, str(k), None, place, road, k)
            for road, k, place in places
        ]
        for camera in ("left", "right")
    ]
    plain: dict[str, Any] = {"consecutive": True, "unmatched": [], "notes": []}
    return DrivingSet("by hand", *sides, truth=[0, 1, 2, 3, 4], **(plain | settings))


def answer(
    number: int,
    winner: int | None = None,
    method: str = "net",
    count: int = 10,
    matcher: str = "orb_gms",
    **facts: Any,
) -> DrivingRecord:
    """The record of a query of `hand_drive` that answers `winner`, with 1 match elsewhere; None: nothing matches."""
    if "failure" not in facts:
        counts = [0] * 5 if winner is None else [1] * 5
        if winner is not None:
            counts[winner] = count
        facts = {"counts": counts} | facts
    name = ["a0", "a1", "a2", "a3", "b0"][number]
    return DrivingRecord(f"{method} {matcher} {name}", method, matcher, f"left/{name}", name[0], number, **facts)


def row_of(rows: Sequence[dict], method: str, ranking: str = "matches") -> dict:
    (found,) = [row for row in rows if (row["method"], row["ranking"]) == (method, ranking)]
    return found


def read_all(drive: DrivingSet, cache: Path | None, *matchers: NamedMatcher, **settings) -> list[Reference]:
    """The drive's references; `cache` keeps them. settings: longest_side, workers."""
    side = settings.pop("longest_side", None)
    return read_references(drive, ReferenceReader(matchers or [gms()], side, cache), **settings)[1]


def same_references(found: list[Reference], other: list[Reference]) -> bool:
    """Whether they are equal to the last bit."""

    def plain(one: Reference) -> tuple:
        tensors = [
            [getattr(own, part) for part in ("keypoints", "descriptors", "scores")] for own in one.features.values()
        ]
        kinds = [[tensor.dtype for tensor in own] for own in tensors]
        sizes = [own.size for own in one.features.values()]
        values = [[tensor.tolist() for tensor in own] for own in tensors]
        return one.size, one.grey, one.descriptor.tolist(), list(one.features), values, kinds, sizes, one.problem

    return len(found) == len(other) and all(plain(a) == plain(b) for a, b in zip(found, other, strict=True))
