"""What is known of a query before it is matched."""

import pytest

from diffnav.errors import UserError
from diffnav.navigation.prior import NOTHING, Prior


def test_a_place_of_its_own_stays() -> None:
    known = Prior((47.0, 8.0), 50.0, heading_deg=30.0)
    assert known.at(Prior((10.0, 20.0), 5.0)) == known


def test_without_one_the_others_place_and_radius_are_taken_and_nothing_else() -> None:
    expected = Prior((10.0, 20.0), 5.0, heading_deg=99.0, ground_sample_distance_m=9.0)
    assert Prior(heading_deg=30.0).at(expected) == Prior((10.0, 20.0), 5.0, heading_deg=30.0)
    assert NOTHING.at(NOTHING) == NOTHING


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"radius_m": 0.0}, "prior.radius_m must be above 0, got 0.0"),
        ({"radius_m": float("nan")}, "prior.radius_m"),
        ({"ground_sample_distance_m": -0.3}, "prior.ground_sample_distance_m must be above 0, got -0.3"),
        ({"place": (120.7, 24.2)}, r"prior.place must be \[latitude, longitude\] in degrees, got \[120.7, 24.2\]"),
        ({"place": (24.2, float("inf"))}, "prior.place"),
    ],
)
def test_settings_out_of_range_are_named(settings: dict, message: str) -> None:
    with pytest.raises(UserError, match=message):
        Prior(**settings)
