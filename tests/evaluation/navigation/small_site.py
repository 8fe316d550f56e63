"""A small place: a map of noise that nothing georeferences, and photos that are parts of it, with their truth."""

import csv
import json
from pathlib import Path

from made_noise import noise
from torch import Tensor

from diffnav.images import write_image

# North, west, south, east: 300 x 400 pixels, a third of a metre each.
BOUNDS = (47.0009, 8.0, 47.0, 8.00176)
MAP_SIZE = (300, 400)
PHOTO_SIZE = (120, 160)
# The photos' first pixels on the map, top and left, along a flight.
PLACES = {"f_1": (20, 20), "f_2": (40, 60), "f_3": (60, 100), "f_4": (80, 140)}


class Site:
    """map: the picture's file, which nothing georeferences. photos: their folder, with photo_metadata.csv."""

    def __init__(self, folder: Path) -> None:
        self.ground: Tensor = noise(MAP_SIZE, 0)
        self.map, self.photos = folder / "map.png", folder / "photos"
        write_image(self.map, self.ground)
        lines = ["Filename,Latitude,Longitude,Gimball_Yaw"]
        for name, (top, left) in PLACES.items():
            part = self.ground[:, top : top + PHOTO_SIZE[0], left : left + PHOTO_SIZE[1]]
            write_image(self.photos / f"{name}.png", part)
            latitude, longitude = self.middle(name)
            lines.append(f"{name}.png,{latitude:.8f},{longitude:.8f},0")
        (self.photos / "photo_metadata.csv").write_text("\n".join(lines) + "\n")

    @staticmethod
    def middle(name: str) -> tuple[float, float]:
        """Latitude and longitude of a photo's middle, linear between the map's outer edges."""
        north, west, south, east = BOUNDS
        top, left = PLACES[name]
        down, along = (top + PHOTO_SIZE[0] / 2) / MAP_SIZE[0], (left + PHOTO_SIZE[1] / 2) / MAP_SIZE[1]
        return north + (south - north) * down, west + (east - west) * along


def quoted(path: Path) -> str:
    return f'"{path}"'


def bounds(values: tuple[float, ...] = BOUNDS) -> str:
    return f"[{','.join(map(str, values))}]"


def summary(tmp_path: Path) -> dict:
    return json.loads((tmp_path / "out" / "navigation.json").read_text())


def table(tmp_path: Path, out: str = "out") -> list[dict[str, str]]:
    with (tmp_path / out / "per_query.csv").open() as file:
        return list(csv.DictReader(file))
