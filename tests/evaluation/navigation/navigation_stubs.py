"""What the tests of the navigation evaluation share: records by hand, a search that answers at once, files of noise."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import torch
from made_noise import noise
from torch import Tensor, nn

from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.queries.query import Query
from diffnav.evaluation.methods import Method
from diffnav.evaluation.navigation.known import Known
from diffnav.evaluation.navigation.records import NavigationRecord, record_of
from diffnav.evaluation.navigation.trial import Trial
from diffnav.evaluation.predictions import PredictionCache
from diffnav.geometry.georeference import AffineGeoreference, LocalMetres
from diffnav.images import write_image
from diffnav.navigation.fix import Fix
from diffnav.navigation.gates.gate import Always
from diffnav.navigation.preparation import Prepared
from diffnav.navigation.prior import Prior

TRUTH = (47.0, 8.0)
# Of a sphere of 6,371,008.8 m: one degree of latitude.
DEGREE_M = 111_195.0797


def north_of(place: tuple[float, float], distance_m: float) -> tuple[float, float]:
    return place[0] + distance_m / DEGREE_M, place[1]


def answer(
    name: str = "q",
    status: str = "fix",
    error_m: float = 0.0,
    *,
    on_map: bool = True,
    truth: tuple[float, float] | None = TRUTH,
    labels: tuple[str, str, str, str] = ("net", "sift", "shortlist", "day"),
    **facts: Any,
) -> NavigationRecord:
    """The record of an answer so far north of the truth; without a place where it is `no_fix`."""
    place = north_of(TRUTH, error_m) if status != "no_fix" else (None, None)
    known = {"inliers": 20, "sigma_m": 1.0, "definition": 9.0} | facts
    fix = Fix(name, status, latitude=place[0], longitude=place[1], **known)
    query = Query(name, Path(f"{name}.png"), truth if on_map else None, on_map)
    return record_of(fix, query, f"{name} {labels}", labels)


@dataclass(frozen=True)
class StubSearcher:
    """Answers every query at once with the same place; `asked` holds what it was asked in this process.

    fails: on queries of this name, with this error.
    """

    matcher_name: str = "stub"
    mode: str = "exhaustive"
    fingerprint: str = "1"
    fails: dict[str, Exception] = field(default_factory=dict)
    asked: list[tuple[str, float, Prior]] = field(default_factory=list)
    matcher = None

    def prepare(self, maps: Any, cache: Path, progress: bool = False) -> list[Any]:  # noqa: ARG002
        return []

    def open(self, maps: Any, cache: Path, preparation: Any) -> "StubSearcher":  # noqa: ARG002
        return self

    def locate_prepared(self, prepared: Prepared, prior: Prior) -> Fix:
        name = prepared.facts["query"]
        if name in self.fails:
            raise self.fails[name]
        if prepared.image is None:
            return prepared.no_fix()
        self.asked.append((name, prepared.image.mean().item(), prior))
        return Fix(status="fix", latitude=TRUTH[0], longitude=TRUTH[1], sigma_m=1.0, inliers=20, **prepared.facts)


def stub_map(name: str = "made", size: tuple[int, int] = (60, 80), fingerprint: str = "content") -> GeoMap:
    """A map of one colour, half a metre a pixel, whose first pixel lies at TRUTH."""
    georeference = AffineGeoreference(size, LocalMetres(TRUTH), (0.5, 0.0, 0.0, 0.0, -0.5, 0.0))
    return GeoMap(name, georeference, _grey, fingerprint)


def _grey(window: tuple[int, int, int, int]) -> Tensor:
    return torch.full((3, *window[2:]), 0.5)


def photo_query(folder: Path, name: str, seed: int = 0, **facts: Any) -> Query:
    """A query in a file of noise, 48 x 64 pixels, that was taken at TRUTH."""
    path = folder / f"{name}.png"
    if not path.exists():
        write_image(path, noise((48, 64), seed))
    return replace(Query(name, path, TRUTH), **facts)


def methods(**enhancers: nn.Module) -> list[Method]:
    return [Method(name, enhancer.eval(), {}) for name, enhancer in enhancers.items()]


def trial(tmp_path: Path, rows: list[Method], **settings: Any) -> Trial:
    """A trial of these rows with one stub search, everything else as simple as it can be."""
    plain: dict[str, Any] = {
        "maps": [stub_map()],
        "methods": rows,
        "searchers": [StubSearcher()],
        "gate": Always(),
        "known": Known(),
        "conditions": [],
        "features": tmp_path / "features",
        "cache": PredictionCache(None),
    }
    return Trial(**(plain | settings))


class Brighten(nn.Module):
    """x^(1/4); fails where it is told to."""

    def __init__(self, fails: bool = False) -> None:
        super().__init__()
        self.fails, self.calls = fails, 0

    def forward(self, image: Tensor, record: object = None) -> Tensor:  # noqa: ARG002
        self.calls += 1
        if self.fails:
            raise RuntimeError("out of memory")
        return image**0.25


def answers(task: Trial, flight: list[Query]) -> list[NavigationRecord]:
    """The records that are made of a flight."""
    return [record for _, record in task(flight) if record]
