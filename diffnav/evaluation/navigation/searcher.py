"""How queries are searched for, as a recipe that a worker process opens for itself."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from diffnav.data.maps.geo_map import GeoMap, Window
from diffnav.errors import UserError
from diffnav.evaluation.contest import NamedMatcher
from diffnav.evaluation.fingerprints import fingerprint
from diffnav.navigation.correlator import CorrelationSearch, Correlator
from diffnav.navigation.faiss_index import faiss_index, is_binary
from diffnav.navigation.feature_store import stored_features
from diffnav.navigation.flight import Locates
from diffnav.navigation.localizer import Localizer, Search
from diffnav.navigation.map_features import MapFeatures
from diffnav.navigation.plausibility import Plausibility
from diffnav.navigation.preparation import Preparation
from diffnav.navigation.reference import Reference
from diffnav.navigation.shortlist import ExactIndex, NearestIndex, Shortlist, joined_offsets
from diffnav.navigation.tiles import tile_windows


@dataclass(frozen=True)
class Tiles:
    """How maps are cut: size (h, w) of a tile in pixels, overlap as of `tile_windows`.

    features: of a tile at most; indexed: of those, the strongest that FAISS indexes.
    Raises: UserError for a size that is no list, or if none shall be indexed.
    """

    size: Sequence[int] = (600, 900)
    overlap: float = 0.33
    features: int = 2000
    indexed: int = 300

    def __post_init__(self) -> None:
        if not isinstance(self.size, Sequence):
            raise UserError(f"tiles.size must be [height, width] in pixels, got {self.size}")
        if self.indexed < 1:
            raise UserError(f"tiles.indexed must be 1 or more, got {self.indexed}")

    def windows(self, geo_map: GeoMap) -> list[Window]:
        """The tiles of a map. Raises: UserError for a size or overlap out of range."""
        return tile_windows(geo_map.size, tuple(self.size), self.overlap)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Searcher:
    """One way to search.

    mode: exhaustive, shortlist or correlation. matcher: of queries; tile_matcher: finds the features of tiles; both
    None for correlation. index: exact or faiss, of the shortlist. tiles, search, plausibility: of the modes with a
    matcher; correlation: of the mode of that name. Raises: UserError for another mode or index.
    """

    mode: str
    matcher: NamedMatcher | None
    tile_matcher: NamedMatcher | None
    index: str = "exact"
    tiles: Tiles = field(default_factory=Tiles)
    search: Search = field(default_factory=Search)
    correlation: CorrelationSearch = field(default_factory=CorrelationSearch)
    plausibility: Plausibility = field(default_factory=Plausibility)

    def __post_init__(self) -> None:
        if self.mode not in ("exhaustive", "shortlist", "correlation"):
            raise UserError(f"modes must be of exhaustive, shortlist and correlation, got {self.mode!r}")
        if self.index not in ("exact", "faiss"):
            raise UserError(f"index must be exact or faiss, got {self.index!r}")

    @property
    def matcher_name(self) -> str:
        """What its rows call the matcher."""
        return self.matcher.name if self.matcher is not None else "gradients"

    @cached_property
    def fingerprint(self) -> str:
        """A hash of all that decides an answer, but for maps, query and prior: settings of other modes do not count."""
        facts: list[Any] = [self.mode]
        if self.matcher is None or self.tile_matcher is None:
            facts.append(asdict(self.correlation))
        else:
            search, tiles = asdict(self.search), asdict(self.tiles)
            if self.mode == "exhaustive":
                del search["tiles"]
            if not self._uses_faiss:
                del tiles["indexed"]
            facts += [search, tiles, asdict(self.plausibility), self._uses_faiss]
            facts += [self.matcher.fingerprint, self.tile_matcher.fingerprint]
        code = fingerprint({}, {__name__, Localizer.__module__, Correlator.__module__})
        text = json.dumps([facts, code], sort_keys=True, default=list)
        return hashlib.sha256(text.encode()).hexdigest()[:32]

    @property
    def _uses_faiss(self) -> bool:
        return self.mode == "shortlist" and self.index == "faiss"

    def features(self, maps: Sequence[GeoMap], cache: Path, progress: bool = False) -> list[MapFeatures]:
        """The features of the maps' tiles, found now or before. Raises: ImageError; UserError."""
        if self.tile_matcher is None:
            return []
        # Of the same code and libraries too: what another release found is no part of an answer.
        folder = cache / self.tile_matcher.fingerprint[:16]
        return [
            stored_features(one, self.tiles.windows(one), self.tile_matcher.matcher, folder, progress) for one in maps
        ]

    def prepare(self, maps: Sequence[GeoMap], cache: Path, progress: bool = False) -> list[MapFeatures]:
        """All that workers will need, found now or before: the maps' features, which are returned, and the index."""
        features = self.features(maps, cache, progress)
        if features and self._uses_faiss:
            faiss_index(features, cache, self.tiles.indexed, progress=progress)
        return features

    def open(self, maps: Sequence[GeoMap], cache: Path, preparation: Preparation) -> Locates:
        """The localizer for these maps."""
        if self.matcher is None or self.tile_matcher is None:
            return Correlator(maps, preparation, self.correlation)
        features = self.features(maps, cache)
        shortlist = None
        if self.mode == "shortlist":
            shortlist = Shortlist(joined_offsets(features), self._index(features, cache))
        return Localizer(
            Reference(features), self.matcher.matcher, preparation, shortlist, self.plausibility, self.search
        )

    def _index(self, features: Sequence[MapFeatures], cache: Path) -> NearestIndex:
        if self.index == "faiss":
            return faiss_index(features, cache, self.tiles.indexed)
        return ExactIndex([one.descriptors for one in features], is_binary(features))
