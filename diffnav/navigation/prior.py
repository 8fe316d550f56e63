"""What is known of a query before it is matched: about where it was taken, its heading, its scale."""

import math
from dataclasses import dataclass, replace

from diffnav.errors import UserError


@dataclass(frozen=True)
class Prior:
    """A circle on the ground and, where known, how the picture lies in it.

    place: latitude, longitude in degrees; radius_m: the picture's middle lies within, as far as anybody knows; None:
    anywhere. heading_deg: compass heading of the picture's top. ground_sample_distance_m: metres a pixel.
    Raises: UserError for a radius or ground sample distance of 0 or less, or what is no place.
    """

    place: tuple[float, float] | None = None
    radius_m: float | None = None
    heading_deg: float | None = None
    ground_sample_distance_m: float | None = None

    def __post_init__(self) -> None:
        for name in ("radius_m", "ground_sample_distance_m"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise UserError(f"prior.{name} must be above 0, got {value}")
        if self.place is not None and not (abs(self.place[0]) <= 90 and math.isfinite(self.place[1])):
            raise UserError(f"prior.place must be [latitude, longitude] in degrees, got {list(self.place)}")

    def at(self, other: "Prior") -> "Prior":
        """The same with the other's place, unless it has one of its own."""
        return self if self.place is not None else replace(self, place=other.place, radius_m=other.radius_m)


NOTHING = Prior()
