"""Parked cars: where they stand, their shade on the road, and their sides and backs."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from diffnav.data.driving.street.canvas import Box, Canvas
from diffnav.data.driving.street.texture import Array, grain, tiles
from diffnav.data.scenery import shapes
from diffnav.data.scenery.ground import rgb
from diffnav.data.scenery.noise import hash_cells, salted, uniform
from diffnav.data.scenery.roads import CAR_COLOURS

PLACE_M = 6.4
LENGTH_M, INNER_M, OUTER_M = 4.4, 4.05, 5.75
SHARE = 0.5
_SILL_M = 0.28


@dataclass(frozen=True)
class Car:
    """A parked car: side -1 is left, +1 right; back_m is where its back stands along the street; height_m; code."""

    side: int
    back_m: float
    height_m: float
    code: int


def cars_between(seed: int, from_m: float, to_m: float) -> Iterator[Car]:
    """The cars whose places lie between two positions along the street."""
    for side in (-1, 1):
        places = np.arange(int(np.floor(from_m / PLACE_M)), int(np.floor(to_m / PLACE_M)) + 1)
        taken, back, code = _places(seed, places, np.full(places.shape, side))
        height = 1.7 + 0.6 * uniform(code, 3) ** 2
        for k in np.flatnonzero(taken):
            yield Car(side, float(back[k]), float(height[k]), int(code[k]))


def car_cover(seed: int, x: Array, z: Array, footprint_x: Array, footprint_z: Array) -> Array:
    """(N,) coverage of the ground at x, z by cars and the shade about them."""
    taken, back, _ = _places(seed, np.floor(z / PLACE_M).astype(np.int64), np.where(x > 0, 1, -1))
    middle, half = (INNER_M + OUTER_M) / 2, (OUTER_M - INNER_M) / 2
    along = z - back - LENGTH_M / 2
    return (
        taken
        * shapes.stripe(np.abs(x) - middle, half + 0.1, footprint_x + 0.15)
        * shapes.stripe(along, LENGTH_M / 2 + 0.1, footprint_z + 0.15)
    )


def draw_car(canvas: Canvas, car: Car) -> None:
    """Draw the back and the side towards the road."""
    inner, outer = sorted((car.side * INNER_M, car.side * OUTER_M))
    front_m = car.back_m + LENGTH_M
    paint = CAR_COLOURS[car.code % len(CAR_COLOURS)][:, None]
    side = Box(car.back_m, front_m, -car.height_m, -0.02)
    canvas.beside(car.side * INNER_M, side, lambda u, v, fu, fv: _side(car, paint, u - car.back_m, -v, fu, fv))
    back = Box(inner, outer, -car.height_m, -0.02)
    canvas.facing(car.back_m, back, lambda u, v, fu, fv: _back(car, paint, u - (inner + outer) / 2, -v, fu, fv))


def _places(seed: int, places: Array, sides: Array) -> tuple[Array, Array, Array]:
    """Whether each place of a side is taken, where the car's back is, and its code."""
    code = hash_cells(salted(seed, 10), places, sides)
    back = places * PLACE_M + (PLACE_M - LENGTH_M) * uniform(code, 1)
    return uniform(code, 2) < SHARE, back, code


def _side(car: Car, paint: Array, along: Array, up: Array, fu: Array, fv: Array) -> tuple[Array, Array]:
    sheen = 0.75 + 0.35 * up / car.height_m + 0.25 * grain(car.code, along, up, np.maximum(fu, fv))
    colour = paint * sheen
    seams = np.maximum(shapes.stripe(shapes.repeated(along - 0.9, 1.15), 0.012, fu), shapes.stripe(up - 0.62, 0.02, fv))
    colour = colour * (1 - 0.6 * seams * (up < 1.0))
    pillars = 1 - shapes.stripe(shapes.repeated(along - 0.9, 1.15), 0.06, fu)
    glass = shapes.stripe(along - 0.52 * LENGTH_M, 0.4 * LENGTH_M, fu) * shapes.stripe(
        up - 0.62 * car.height_m, 0.17 * car.height_m, fv
    )
    mirrored = 0.12 + 0.4 * tiles(car.code, along, up, (0.7, 0.22), (fu, fv)) ** 2
    colour = shapes.blend(colour, rgb(0.85, 0.95, 1.0) * mirrored, glass * pillars)
    handle = shapes.box(shapes.repeated(along - 1.4, 1.15), up - 0.85, 0.09, 0.02, fv)
    colour = shapes.blend(colour, rgb(0.2, 0.2, 0.2), handle * (np.abs(along - 2) < 1))
    wheel = shapes.repeated(along - 0.8, 2.7)
    away = np.hypot(wheel, up - 0.33)
    foot = np.maximum(fu, fv)
    tyre, rim = shapes.inside(away - 0.33, foot), shapes.inside(away - 0.2, foot)
    spokes = 0.35 + 0.4 * (np.cos(5 * np.arctan2(up - 0.33, wheel)) > 0)
    colour = shapes.blend(shapes.blend(colour, rgb(0.06, 0.06, 0.06), tyre), rgb(1, 1, 1) * spokes, rim)
    return colour, np.maximum(shapes.inside(_SILL_M - up, fv), tyre)


def _back(car: Car, paint: Array, across: Array, up: Array, fu: Array, fv: Array) -> tuple[Array, Array]:
    half, feet = (OUTER_M - INNER_M) / 2, (fu, fv)
    colour = paint * (0.55 + 0.3 * up / car.height_m + 0.2 * grain(car.code + 1, across, up, fu))
    colour = shapes.blend(colour, rgb(0.12, 0.12, 0.13), shapes.stripe(up - 0.5, 0.14, fv))
    glass = shapes.box(across, up - 0.74 * car.height_m, half - 0.16, 0.15 * car.height_m, fu)
    mirrored = 0.1 + 0.35 * tiles(car.code + 2, across, up, (0.3, 0.2), feet) ** 2
    colour = shapes.blend(colour, rgb(0.85, 0.95, 1.0) * mirrored, glass)
    lamps = shapes.box(np.abs(across) - half + 0.15, up - 0.95, 0.1, 0.16, fu)
    colour = shapes.blend(colour, rgb(0.72, 0.10, 0.08), lamps)
    plate = shapes.box(across, up - 0.75, 0.26, 0.06, fu)
    letters = 0.15 + 0.8 * (tiles(car.code + 3, across, up - 0.72, (0.055, 0.06), feet) > 0.45)
    colour = shapes.blend(colour, rgb(1.0, 1.0, 0.9) * letters, plate)
    wheels = shapes.box(np.abs(across) - half + 0.14, up - 0.15, 0.11, 0.15, fu)
    colour = shapes.blend(colour, rgb(0.06, 0.06, 0.06), wheels)
    return colour, np.maximum(shapes.inside(_SILL_M - up, fv), wheels)
