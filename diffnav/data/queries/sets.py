"""The sets of queries that an evaluation asks, each from its maps, a darkness and a seed."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from diffnav.darkness import DarknessModel
from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.photos import folder_photos
from diffnav.data.queries.camera import Camera, Range
from diffnav.data.queries.cut import cut_queries
from diffnav.data.queries.darkened import darkened, is_dark
from diffnav.data.queries.folder import folder_queries
from diffnav.data.queries.off_map import off_map_queries
from diffnav.data.queries.query import Query
from diffnav.data.queries.truth_table import Columns
from diffnav.errors import UserError
from diffnav.geometry.georeference import ground_sample_distance_m


@dataclass(frozen=True)
class QuerySet:
    """queries, in the order of the flight; problems: sentences on what is left out or unknown of them."""

    queries: Sequence[Query]
    problems: Sequence[str] = field(default_factory=list)


def photo_set(
    maps: Sequence[GeoMap],
    darkness: DarknessModel,
    seed: int,
    path: str | Path | None,
    truth: str | Path = "auto",
    columns: Columns | None = None,
    darken: bool = False,
    dark: float = 0.5,
    on_map: bool = True,
) -> QuerySet:
    """The photos below a folder, or one photo.

    Args:
        darken: with a dark picture of each.
        dark: the share of them of which the dark picture is delivered.
        on_map: whether the maps show their places; where the truth of one that they should show lies on none of them,
            a problem says so.

    Raises: UserError.
    """
    if path is None:
        raise UserError("queries is missing: name a folder of photos, or a photo, as queries=PATH")
    if not isinstance(path, str | Path):
        raise UserError(f"queries must be one folder of photos, or a photo, got {path}")
    queries, problems = folder_queries(path, truth, columns)
    queries = [replace(query, on_map=on_map) for query in queries]
    problems = problems + (_astray(queries, maps) if on_map else [])
    if not darken:
        return QuerySet(queries, problems)
    return QuerySet([darkened(one, darkness, seed, is_dark(k, dark)) for k, one in enumerate(queries)], problems)


def cut_set(
    maps: Sequence[GeoMap],
    darkness: DarknessModel,
    seed: int,
    per_map: int = 10,
    off_map: int = 0,
    off_map_photos: str | Path | None = None,
    size: tuple[int, int] = (400, 600),
    heading_deg: float = 0.0,
    scale: Range = (1.0, 1.0),
    tilt: float = 0.0,
    dark: float = 0.5,
    camera: Camera | None = None,
) -> QuerySet:
    """Pictures cut from the maps, map by map, then `off_map` of places that they do not show. Raises: UserError."""
    if not per_map and not off_map:
        raise UserError("query_set.per_map and query_set.off_map are both 0: there is nothing to ask")
    queries: list[Query] = []
    if per_map:
        queries += cut_queries(
            maps, per_map, seed, size=size, heading_deg=heading_deg, scale=scale, tilt=tilt, camera=camera, dark=dark,
            darkness=darkness,
        )  # fmt: skip
    if off_map:
        queries += off_map_queries(
            off_map, seed, photos=folder_photos(off_map_photos) if off_map_photos else (), size=size,
            ground_sample_distance_m=float(ground_sample_distance_m(maps[0].georeference)), heading_deg=heading_deg,
            scale=scale, tilt=tilt, camera=camera, dark=dark, darkness=darkness,
        )  # fmt: skip
    return QuerySet(queries)


def _astray(queries: Sequence[Query], maps: Sequence[GeoMap]) -> list[str]:
    """A sentence on queries whose truth lies on no map."""
    names = [query.name for query in queries if query.truth and not any(_shows(one, query.truth) for one in maps)]
    if not names:
        return []
    known = sum(query.truth is not None for query in queries)
    return [
        f"the truth of {len(names)} of {known} photos lies on no map, the first is {names[0]}; if that is right, ask "
        "them apart with query_set.on_map=false"
    ]


def _shows(geo_map: GeoMap, place: tuple[float, float]) -> bool:
    height, width = geo_map.size
    x, y = geo_map.georeference.pixels(np.array(place))
    return bool(-0.5 <= x < width - 0.5 and -0.5 <= y < height - 0.5)
