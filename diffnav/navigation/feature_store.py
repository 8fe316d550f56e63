"""A map's features on disk: found once for a map's content, its tiles and a matcher's settings, then memory-mapped."""

import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

from diffnav.data.maps.geo_map import GeoMap, Window
from diffnav.errors import UserError
from diffnav.matching.matches import Matcher
from diffnav.navigation.map_features import MapFeatures

# Of the files; another number finds none of the old ones.
_LAYOUT = 1
_ARRAYS = ("keypoints", "descriptors", "scores")
TileArrays = dict[str, np.ndarray]


def stored_features(
    geo_map: GeoMap, windows: Sequence[Window], matcher: Matcher, folder: Path, progress: bool = False
) -> MapFeatures:
    """The features of a map's tiles, from `folder` where they were found before, otherwise found and kept there.

    Each tile is stored as it is done, so that a stopped search goes on. Raises: ImageError for an unreadable map;
    UserError if the folder cannot be written, or for a matcher without keypoints.
    """
    home = folder / _key(geo_map, windows, matcher)
    if not (home / "facts.json").exists():
        try:
            _find(geo_map, windows, matcher, home, progress)
        except OSError as error:
            # Another process that looks for the same may have ended first and tidied up.
            if not (home / "facts.json").exists():
                raise UserError(f"{home}: cannot be written ({error.strerror}); choose another cache=") from None
    try:
        return load_features(geo_map, windows, home)
    except (OSError, ValueError, KeyError):
        raise UserError(f"{home}: does not hold what was stored there; delete the folder") from None


def write_features(home: Path, tiles: Iterable[TileArrays], numbers: bool = False) -> None:
    """Write features of tiles, in order, as the files that `load_features` reads.

    Args:
        tiles: of each, keypoints (n, 2) float32 of the whole map, descriptors (n, D), scores (n,) float32. They are
            written one by one: all together need not fit into memory.
        numbers: whether descriptors of uint8 are numbers, not bits; float32 of whole numbers become such.
    """
    home.mkdir(parents=True, exist_ok=True)
    aside = {name: home / f"{name}.{os.getpid()}.part" for name in _ARRAYS}
    files = {name: path.open("wb") for name, path in aside.items()}
    offsets, kind, width, bytes_do = [0], "|u1", 0, True
    for tile in tiles:
        for name, file in files.items():
            file.write(np.ascontiguousarray(tile[name]).tobytes())
        descriptors = tile["descriptors"]
        kind, width = descriptors.dtype.str, descriptors.shape[1]
        bytes_do = bytes_do and _are_bytes(descriptors)
        offsets.append(offsets[-1] + len(descriptors))
    for file in files.values():
        file.close()
    numbers = numbers and kind == "|u1"
    if kind == "<f4" and bytes_do:
        _shrink(aside["descriptors"])
        kind, numbers = "|u1", True
    for name, path in aside.items():
        os.replace(path, home / f"{name}.bin")
    np.save(home / "offsets.npy", np.array(offsets, np.int64))
    facts = home / f"facts.{os.getpid()}.part"
    facts.write_text(json.dumps({"descriptors": kind, "width": width, "numbers": numbers}))
    # Last, and at once: without it nothing here counts.
    os.replace(facts, home / "facts.json")


def load_features(geo_map: GeoMap, windows: Sequence[Window], home: Path) -> MapFeatures:
    """The features that `write_features` wrote, as memory maps."""
    facts = json.loads((home / "facts.json").read_text())
    offsets = np.load(home / "offsets.npy")

    def array(name: str, kind: str, *columns: int) -> np.ndarray:
        shape = (int(offsets[-1]), *columns)
        return np.memmap(home / f"{name}.bin", kind, "r", shape=shape) if shape[0] else np.zeros(shape, kind)

    return MapFeatures(
        geo_map,
        tuple(windows),
        offsets,
        array("keypoints", "<f4", 2),
        array("descriptors", facts["descriptors"], facts["width"]),
        array("scores", "<f4"),
        facts["numbers"],
    )


def _key(geo_map: GeoMap, windows: Sequence[Window], matcher: Matcher) -> str:
    facts = [_LAYOUT, geo_map.fingerprint, list(windows), matcher.name, dict(matcher.settings)]
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()[:32]


def _find(geo_map: GeoMap, windows: Sequence[Window], matcher: Matcher, home: Path, progress: bool) -> None:
    parts = [home / "parts" / f"{k}.npz" for k in range(len(windows))]
    parts[0].parent.mkdir(parents=True, exist_ok=True)
    label = f"{geo_map.name}: {matcher.name}"
    for path, window in zip(tqdm(parts, label, unit="tile", disable=not progress, leave=False), windows, strict=True):
        if not path.exists():
            _write_part(path, _tile_arrays(geo_map, window, matcher))
    write_features(home, (_read_part(path) for path in parts))
    shutil.rmtree(parts[0].parent)


def _tile_arrays(geo_map: GeoMap, window: Window, matcher: Matcher) -> TileArrays:
    found = matcher.features(geo_map.read(window))
    if found.image is not None:
        raise UserError(f"matcher={matcher.name} has no keypoints that could be kept for a map; use another, e.g. sift")
    keypoints = found.keypoints + torch.tensor([window[1], window[0]])
    return {
        "keypoints": keypoints.float().numpy(),
        "descriptors": found.descriptors.numpy(),
        "scores": found.scores.float().numpy(),
    }


def _write_part(path: Path, arrays: TileArrays) -> None:
    aside = path.with_suffix(f".{os.getpid()}.part")
    with aside.open("wb") as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]
    os.replace(aside, path)


def _read_part(path: Path) -> TileArrays:
    with np.load(path) as part:
        return {name: part[name] for name in _ARRAYS}


def _are_bytes(descriptors: np.ndarray) -> bool:
    """Whether all are whole numbers from 0 to 255."""
    return bool((descriptors == np.clip(np.round(descriptors), 0, 255)).all())


def _shrink(path: Path) -> None:
    """Rewrite a file of float32 whole numbers as uint8."""
    aside = path.with_suffix(".bytes")
    with path.open("rb") as wide, aside.open("wb") as narrow:
        while block := wide.read(2**26):
            narrow.write(np.frombuffer(block, "<f4").astype(np.uint8).tobytes())
    os.replace(aside, path)
