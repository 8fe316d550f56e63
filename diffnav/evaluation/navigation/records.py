"""What one localizer answered to one query, beside the truth."""

from dataclasses import dataclass, fields
from datetime import datetime
from typing import Any

import torch

from diffnav.data.queries.query import Query
from diffnav.geometry.geodesy import haversine_m
from diffnav.navigation.fix import Fix


@dataclass(frozen=True)
class NavigationRecord:
    """One answer.

    key: of everything that decides it. method: enhancer; matcher, mode: of the search; condition: day or dark. on_map:
    whether a map shows the place. answer: the `Fix` as plain values. error_m: distance from the truth;
    heading_error_deg, scale_ratio: against what is known of the query; each None where there is no place or nothing is
    known. seconds: from the picture to the answer, reading left out. failure: of the method or matcher itself, which is
    tried again when the evaluation goes on. query_heading_deg: the query's true heading, where it is known.
    """

    key: str
    method: str
    matcher: str
    mode: str
    condition: str
    name: str
    on_map: bool
    has_truth: bool
    answer: dict[str, Any]
    error_m: float | None
    heading_error_deg: float | None
    scale_ratio: float | None
    seconds: float
    failure: str | None = None
    query_heading_deg: float | None = None

    @property
    def is_fix(self) -> bool:
        """Whether a place was told on the strength of the picture itself."""
        return self.answer["status"] == "fix"

    @property
    def is_usable(self) -> bool:
        """Whether there was a picture to look for."""
        return self.answer["definition"] is not None

    @property
    def fix(self) -> Fix:
        """The answer."""
        plain = dict(self.answer)
        plain["reasons"], plain["footprint"] = tuple(plain["reasons"]), tuple(map(tuple, plain["footprint"]))
        if plain["H_query_map"] is not None:
            plain["H_query_map"] = torch.tensor(plain["H_query_map"], dtype=torch.float64)
        if plain["time"] is not None:
            plain["time"] = datetime.fromisoformat(plain["time"])
        return Fix(**plain)

    def flat(self) -> dict[str, Any]:
        """The record as one row of a table."""
        shown = ("status", "latitude", "longitude", "sigma_m", "heading_deg", "ground_sample_distance_m", "inliers",
                 "matches", "map", "tile", "enhanced", "definition")  # fmt: skip
        return {
            **{name: getattr(self, name) for name in ("name", "method", "matcher", "mode", "condition", "on_map")},
            **{name: self.answer[name] for name in shown},
            "reasons": "; ".join(self.answer["reasons"]) or self.failure or "",
            **{name: getattr(self, name) for name in ("error_m", "heading_error_deg", "scale_ratio", "seconds")},
            "query_heading_deg": self.query_heading_deg,
            **{f"ms_{stage}": round(value, 1) for stage, value in self.answer["milliseconds"].items()},
        }


def record_of(
    fix: Fix, query: Query, key: str, labels: tuple[str, str, str, str], failure: str | None = None
) -> NavigationRecord:
    """The record of an answer to a query; labels: method, matcher, mode, condition; failure: of method or matcher."""
    error_m = heading_error_deg = scale_ratio = None
    if fix.place is not None and query.truth is not None:
        error_m = float(haversine_m(fix.place, query.truth))
    if fix.heading_deg is not None and query.heading_deg is not None:
        heading_error_deg = (fix.heading_deg - query.heading_deg + 180) % 360 - 180
    if fix.ground_sample_distance_m is not None and query.ground_sample_distance_m is not None:
        scale_ratio = fix.ground_sample_distance_m / query.ground_sample_distance_m
    seconds = sum(value for stage, value in fix.milliseconds.items() if stage != "read") / 1000
    facts = (query.name, query.on_map, query.truth is not None, _plain(fix))
    figures = (error_m, heading_error_deg, scale_ratio, seconds)
    return NavigationRecord(key, *labels, *facts, *figures, failure, query.heading_deg)


def _plain(fix: Fix) -> dict[str, Any]:
    """A fix as JSON has it."""
    plain = {one.name: getattr(fix, one.name) for one in fields(Fix)}
    plain["milliseconds"] = dict(fix.milliseconds)
    plain["H_query_map"] = None if fix.H_query_map is None else fix.H_query_map.tolist()
    plain["time"] = None if fix.time is None else fix.time.isoformat()
    return plain | {"reasons": list(fix.reasons), "footprint": [list(place) for place in fix.footprint]}
