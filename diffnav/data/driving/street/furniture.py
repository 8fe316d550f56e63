"""What stands on the pavements: lamp posts with traffic signs, trees, shop signs; and the houses' flanks."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from diffnav.data.driving.street.buildings import plots
from diffnav.data.driving.street.canvas import Box, Canvas
from diffnav.data.driving.street.texture import Array, grain, tiles
from diffnav.data.scenery import shapes
from diffnav.data.scenery.ground import rgb
from diffnav.data.scenery.noise import hash_cells, salted, uniform

# (z, draw): how far along the street a thing stands, and what draws it.
Thing = tuple[float, Callable[[Canvas], None]]
POST_PLACE_M, TREE_PLACE_M, SIGN_PLACE_M = 17.0, 11.0, 8.0


def things_between(seed: int, wall_m: float, from_m: float, to_m: float) -> Iterator[Thing]:
    """Posts, trees, shop signs and flanks between two positions along the street; fronts stand at +-wall_m."""
    for row, side in enumerate((-1, 1)):
        for z, code in _placed(salted(seed, 40), side, POST_PLACE_M, 0.9, from_m, to_m):
            yield z, partial(_post, x=side * 6.5, z=z, code=code)
        for z, code in _placed(salted(seed, 41), side, TREE_PLACE_M, 0.55, from_m, to_m):
            yield z, partial(_tree, x=side * 7.3, z=z, code=code)
        for z, code in _placed(salted(seed, 42), side, SIGN_PLACE_M, 0.6, from_m, to_m):
            yield z, partial(_shop_sign, x=side * (wall_m - 0.55), z=z, code=code)
        edges = np.unique(plots(seed, row, np.arange(from_m, to_m, 2.0)).left_m)
        edges = edges[edges > from_m]
        for z, height in zip(edges.tolist(), plots(seed, row, edges + 0.01).height_m.tolist(), strict=True):
            if height:
                yield z, partial(_flank, seed=seed, side=side, wall_m=wall_m, z=z, top=-height)


def _placed(seed: int, side: int, place_m: float, share: float, from_m: float, to_m: float) -> list[tuple[float, int]]:
    """(z, code) of the things of one kind on one side: at most one in every `place_m`."""
    places = np.arange(int(np.floor(from_m / place_m)), int(np.floor(to_m / place_m)) + 1)
    code = hash_cells(seed, places, np.full(places.shape, side))
    z = (places + 0.15 + 0.7 * uniform(code, 1)) * place_m
    return [(float(z[k]), int(code[k])) for k in np.flatnonzero(uniform(code, 2) < share)]


def _number(code: int, salt: int) -> float:
    return float(uniform(np.array([code], np.uint32), salt)[0])


def _post(canvas: Canvas, x: float, z: float, code: int) -> None:
    def post(u: Array, v: Array, fu: Array, fv: Array) -> tuple[Array, Array]:
        bands = 0.32 + 0.15 * (np.cos((u - x) / 0.09 * 1.5)) + 0.25 * (shapes.stripe(shapes.repeated(v, 0.8), 0.03, fv))
        return rgb(0.9, 0.95, 1.0) * bands, np.ones_like(fu)

    def plate(u: Array, v: Array, fu: Array, fv: Array) -> tuple[Array, Array]:
        away = np.hypot(u - x, v - middle)
        tone = np.clip(8 * (tiles(code, u - x, v - middle, (0.13, 0.13), (fu, fv)) - 0.5) + 0.5, 0, 1)
        inner = shapes.blend(rgb(0.95, 0.95, 0.93) * np.ones_like(fu), rgb(0.05, 0.05, 0.08), tone)
        colour = shapes.blend(border * np.ones_like(fu), inner, shapes.inside(away - 0.3, fu))
        return colour, shapes.inside(away - 0.4, fu)

    canvas.facing(z, Box(x - 0.08, x + 0.08, -5.5, 0.0), post)
    if _number(code, 3) < 0.8:
        middle = -2.3 - 0.6 * _number(code, 4)
        border = rgb(0.75, 0.1, 0.1) if _number(code, 5) < 0.6 else rgb(0.1, 0.25, 0.65)
        canvas.facing(z - 0.1, Box(x - 0.42, x + 0.42, middle - 0.42, middle + 0.42), plate)


def _tree(canvas: Canvas, x: float, z: float, code: int) -> None:
    middle, radius = -4.6 - 0.8 * _number(code, 3), 1.3 + 0.7 * _number(code, 4)

    def trunk(u: Array, v: Array, fu: Array, fv: Array) -> tuple[Array, Array]:
        bark = 0.3 + 0.5 * grain(code, 3 * u, v, np.maximum(3 * fu, fv))
        return rgb(0.95, 0.8, 0.62) * bark, np.ones_like(fu)

    def crown(u: Array, v: Array, fu: Array, fv: Array) -> tuple[Array, Array]:
        rough = grain(code, u, v, fu)
        leaves = tiles(code + 1, u + 0.1 * rough, v, (0.13, 0.10), (fu, fv))
        light = 0.16 + 0.4 * leaves + 0.35 * rough - 0.12 * (v - middle) / radius
        away = np.hypot(u - x, (v - middle) / 0.85) - radius * (0.8 + 0.6 * rough)
        return rgb(0.75, 1.0, 0.45) * np.maximum(light, 0.03), shapes.inside(away, fu) * (0.4 + 0.6 * (leaves > 0.12))

    canvas.facing(z, Box(x - 0.13, x + 0.13, middle, 0.0), trunk)
    canvas.facing(z - 0.05, Box(x - radius, x + radius, middle - radius, middle + radius), crown)


def _shop_sign(canvas: Canvas, x: float, z: float, code: int) -> None:
    middle, half = -3.3 - 0.9 * _number(code, 3), 0.3 + 0.35 * _number(code, 4)
    tint = np.array([[_number(code, k)] for k in (5, 6, 7)], np.float32)

    def sign(u: Array, v: Array, fu: Array, fv: Array) -> tuple[Array, Array]:
        ink = np.clip(8 * (tiles(code, u - x, v - middle, (0.12, 0.16), (fu, fv)) - 0.5) + 0.5, 0, 1)
        rim = shapes.box(u - x, v - middle, 0.42, half - 0.07, fu)
        return shapes.blend(tint * np.ones_like(fu), 1 - tint, ink * rim), np.ones_like(fu)

    canvas.facing(z, Box(x - 0.5, x + 0.5, middle - half, middle + half), sign)


def _flank(canvas: Canvas, seed: int, side: int, wall_m: float, z: float, top: float) -> None:
    left, right = sorted((side * wall_m, side * (wall_m + 11.0)))

    def plaster(u: Array, v: Array, fu: Array, fv: Array) -> tuple[Array, Array]:
        rough = grain(salted(seed, 43), u + z, v, fu)
        blocks = tiles(int(abs(z) * 1000), u, v, (0.5, 0.25), (fu, fv)) - 0.5
        return rgb(0.56, 0.53, 0.5) * (1 + 0.6 * rough + 0.3 * blocks), np.ones_like(fu)

    canvas.facing(z, Box(left, right, top, 0.0), plaster)
