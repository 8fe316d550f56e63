"""What a camera or a table tells of a picture: where, how high, which way, when."""

from dataclasses import dataclass, fields, replace
from datetime import datetime

_TIME_FORMATS = ("%Y:%m:%d %H:%M:%S", "%Y/%m/%d %H:%M:%S", "%Y/%m/%d %H:%M", "%d.%m.%Y %H:%M:%S")


@dataclass(frozen=True)
class Truth:
    """What is known of one picture; None where nobody says.

    latitude, longitude: degrees, of the camera (of a picture straight down, of its centre). height_m: above ground.
    heading_deg: compass heading of the picture's top, in [0, 360). time: as recorded, without a zone where none was.
    pixel_angle_rad: what one pixel sees; times the height it is the ground sample distance of a picture straight down.
    """

    latitude: float | None = None
    longitude: float | None = None
    height_m: float | None = None
    heading_deg: float | None = None
    time: datetime | None = None
    pixel_angle_rad: float | None = None

    @property
    def place(self) -> tuple[float, float] | None:
        """Latitude and longitude, None without them."""
        return None if self.latitude is None or self.longitude is None else (self.latitude, self.longitude)

    @property
    def ground_sample_distance_m(self) -> float | None:
        """Metres a pixel of a picture straight down, None where height or angle are not known or make no sense."""
        if self.height_m is None or self.pixel_angle_rad is None or self.height_m <= 0:
            return None
        return self.height_m * self.pixel_angle_rad

    def completed(self, other: "Truth") -> "Truth":
        """This one with what it lacks taken from another; a place is taken whole or not at all."""
        missing = {field.name for field in fields(self) if getattr(self, field.name) is None}
        if self.place is not None:
            missing -= {"latitude", "longitude"}
        return replace(self, **{name: getattr(other, name) for name in missing})

    def without_place(self) -> "Truth":
        """This one without latitude and longitude."""
        return replace(self, latitude=None, longitude=None)


def parsed_time(text: str) -> datetime | None:
    """The time in ISO 8601, as EXIF writes it or nearly so; None for anything else."""
    text = text.strip(" \0")
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        pass
    for pattern in _TIME_FORMATS:
        try:
            return datetime.strptime(text, pattern)
        except ValueError:
            continue
    return None
