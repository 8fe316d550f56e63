"""The maps of the scale study: nine real tiles that the queries show, and as many simulated ones as are asked for."""

import hashlib
import json
import math
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from torch import Tensor
from tqdm import tqdm

from diffnav.data.maps.geo_map import GeoMap, Window
from diffnav.data.maps.world import WorldMap, world_maps
from diffnav.errors import UserError
from diffnav.evaluation.navigation.simulated_tiles import RECIPE, make_pool, simulated_tiles
from diffnav.geometry.georeference import AffineGeoreference, LocalMetres
from diffnav.images import ImageError
from diffnav.matching.matches import Features, Matcher
from diffnav.matching.sift import Sift
from diffnav.navigation.feature_store import load_features, stored_features, write_features
from diffnav.navigation.map_features import MapFeatures
from diffnav.navigation.tiles import Size, tile_windows

# The real map has this many rows and columns of tiles.
_SIDE = 3
REAL_TILES = _SIDE**2
# Far from the embedded world's maps, which begin at 47 north, 8 east; metres a pixel are as theirs.
_ORIGIN, _PIXEL_M = (-40.0, 100.0), 0.3
# Bytes of a feature in the store and in the index: 128 of the descriptor, with its place, score and number.
_STORED, _INDEXED = 128 + 3 * 4, 128 + 8
# That the disk must have left.
_SPARE_BYTES = 10**9


@dataclass(frozen=True)
class ScaleMaps:
    """One map of nine tiles of the embedded world, and another, far away, of simulated ones.

    cache: folder of pictures and features. tile: (h, w), pixels. features: of a tile at most, SIFT; indexed: of those,
    the strongest that the shortlist searches. pool: real tiles, each of another place of the world, of which the
    simulated ones are made. Raises: UserError for a setting out of range.
    """

    cache: Path
    tile: Size = (400, 600)
    features: int = 300
    indexed: int = 200
    pool: int = 60
    seed: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "cache", Path(self.cache).expanduser())
        if len(self.tile) != 2:
            raise UserError(f"maps.tile must be [height, width] in pixels, got {list(self.tile)}")
        object.__setattr__(self, "tile", (self.tile[0], self.tile[1]))
        if not 1 <= self.indexed <= self.features:
            raise UserError(f"maps.indexed must be from 1 to maps.features={self.features}, got {self.indexed}")
        if self.pool < 4:
            raise UserError(f"maps.pool must be 4 tiles or more, got {self.pool}")

    def real(self) -> WorldMap:
        """The map that the queries are cut from."""
        size = _SIDE * self.tile[0], _SIDE * self.tile[1]
        return world_maps(self.seed, 1, size, _PIXEL_M, cache=self.cache / "world")[0]

    def database(self, count: int, progress: bool = False) -> list[MapFeatures]:
        """The features of `count` tiles, the real ones first, found or simulated now or before.

        Raises: UserError if they cannot be kept.
        """
        real = self.real()
        maps = [stored_features(real, tile_windows(real.size, self.tile), sift(self.features), self._folder, progress)]
        if count == REAL_TILES:
            return maps
        others, windows = self._simulated(count - REAL_TILES)
        home = self._home(len(windows))
        if not (home / "facts.json").exists():
            tiles = simulated_tiles(make_pool(self.pool_tiles(progress)), windows, self.seed)
            bar = tqdm(tiles, "simulating", len(windows), unit="tile", disable=not progress, leave=False)
            try:
                write_features(home, bar, numbers=True)
            except OSError as error:
                raise UserError(f"{home}: cannot be written ({error.strerror}); choose another cache=") from None
        return [*maps, load_features(others, windows, home)]

    def pool_tiles(self, progress: bool = False) -> list[Features]:
        """The features of the pool's tiles. Raises: UserError if they cannot be kept."""
        bar = tqdm(self._pool_maps(), "pool", unit="tile", disable=not progress, leave=False)
        whole = (0, 0, *self.tile)
        return [stored_features(one, [whole], sift(self.features), self._folder).tile(0) for one in bar]

    def require_room(self, counts: Sequence[int]) -> None:
        """Raise UserError if the disk of the cache has too little room for the tiles of all counts."""
        tiles = sum(count for count in counts if not self._exists(count))
        needed = tiles * (self.features * _STORED + self.indexed * _INDEXED)
        there = next(folder for folder in (self.cache, *self.cache.absolute().parents) if folder.exists())
        free = shutil.disk_usage(there).free
        if free < needed + _SPARE_BYTES:
            raise UserError(
                f"{self.cache}: {free / 1e9:.1f} GB are free, {(needed + _SPARE_BYTES) / 1e9:.1f} GB are needed; "
                "choose another cache= or fewer counts="
            )

    @property
    def _folder(self) -> Path:
        return self.cache / "features"

    def _pool_maps(self) -> list[WorldMap]:
        # The first lies where the real map does.
        return world_maps(self.seed, self.pool + 1, self.tile, _PIXEL_M, cache=self.cache / "world")[1:]

    def _exists(self, count: int) -> bool:
        return count == REAL_TILES or (self._home(count - REAL_TILES) / "facts.json").exists()

    def _home(self, count: int) -> Path:
        """Where the features of so many simulated tiles are kept."""
        sources = [one.fingerprint for one in self._pool_maps()]
        facts = ["simulated tiles", RECIPE, sources, dict(sift(self.features).settings), self.tile, count, self.seed]
        return self._folder / hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:32]

    def _simulated(self, count: int) -> tuple[GeoMap, list[Window]]:
        """The map of so many simulated tiles and their windows, row by row."""
        columns = math.isqrt(count - 1) + 1
        height, width = self.tile
        windows = [(k // columns * height, k % columns * width, height, width) for k in range(count)]
        size = (windows[-1][0] + height, columns * width)
        transform = (_PIXEL_M, 0.0, 0.0, 0.0, -_PIXEL_M, 0.0)
        georeference = AffineGeoreference(size, LocalMetres(_ORIGIN), transform)
        return GeoMap("simulated", georeference, _no_picture, self._home(count).name), windows


def sift(features: int) -> Matcher:
    """The matcher of the study."""
    return cast(Matcher, Sift(features))


def _no_picture(window: Window) -> Tensor:
    raise ImageError(f"simulated: there is no picture at {window}, only features")
