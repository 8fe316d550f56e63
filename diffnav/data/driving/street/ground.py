"""The road and its pavements, painted at points of the plane y = 0."""

import numpy as np

from diffnav.data.driving.street.cars import car_cover
from diffnav.data.driving.street.texture import Array, grain, tiles
from diffnav.data.scenery import shapes
from diffnav.data.scenery.ground import rgb
from diffnav.data.scenery.noise import hash_cells, salted, uniform

ROAD_HALF_M = 6.0
# Centre line: dashes from 9 k to 9 k + 3 m along the street, 15 cm wide.
DASH_PERIOD_M, DASH_M, DASH_HALF_WIDTH_M = 9.0, 3.0, 0.075
EDGE_LINE_M = 3.6
_PAINT = rgb(0.88, 0.88, 0.85)


def ground(seed: int, x: Array, z: Array, footprint_x: Array, footprint_z: Array) -> Array:
    """(3, N) RGB of the ground at x, z (N,) metres; footprints: metres that a pixel covers along each."""
    rough = grain(salted(seed, 1), x, z, np.maximum(footprint_x, 0.5 * footprint_z))
    feet = (footprint_x, footprint_z)
    patches = tiles(salted(seed, 2), x + 0.6 * rough, z, (2.4, 5.5), feet) - 0.5
    spots = tiles(salted(seed, 3), x, z, (0.11, 0.11), feet) - 0.5
    tone = 0.37 * (1 + 0.4 * rough + 0.3 * patches + 0.18 * spots)
    colour = rgb(1.0, 0.99, 0.97) * tone
    colour = shapes.blend(colour, rgb(0.10, 0.10, 0.10), _holes(seed, x, z, feet))
    colour = shapes.blend(colour, _PAINT * (0.85 + 0.6 * rough), _markings(seed, x, z, feet, rough))
    beyond = np.abs(x) > ROAD_HALF_M - 0.5
    feet_beyond = footprint_x[beyond], footprint_z[beyond]
    colour[:, beyond] = _pavement(seed, colour[:, beyond], x[beyond], z[beyond], feet_beyond, rough[beyond])
    return colour * (1 - 0.6 * car_cover(seed, x, z, footprint_x, footprint_z))


def _markings(seed: int, x: Array, z: Array, feet: tuple[Array, Array], rough: Array) -> Array:
    """(N,) coverage by paint: centre dashes, worn edge lines, zebra crossings."""
    along = shapes.repeated(z - DASH_M / 2, DASH_PERIOD_M)
    dash = shapes.stripe(x, DASH_HALF_WIDTH_M, feet[0]) * shapes.stripe(along, DASH_M / 2, feet[1])
    edge = shapes.stripe(np.abs(x) - EDGE_LINE_M, 0.06, feet[0]) * np.clip(0.8 + 2.5 * rough, 0, 1)
    block = np.floor(z / 47.0)
    crossing = (block + 0.3 + 0.4 * uniform(hash_cells(salted(seed, 4), block.astype(np.int64)))) * 47.0
    bars = shapes.stripe(shapes.repeated(x, 1.0), 0.25, feet[0]) * (np.abs(x) < 5.5)
    zebra = bars * shapes.stripe(z - crossing, 1.6, feet[1]) * np.clip(0.9 + rough, 0, 1)
    return np.maximum(np.maximum(dash, edge), zebra)


def _holes(seed: int, x: Array, z: Array, feet: tuple[Array, Array]) -> Array:
    """(N,) coverage by manholes and drains, one at most in every 13 m of either lane."""
    lane, place = np.where(x > 0, 1, 0), np.floor(z / 13.0)
    code = hash_cells(salted(seed, 5), place.astype(np.int64), lane)
    away_x = np.abs(x) - 1.2 - 1.6 * uniform(code, 1)
    away_z = z - (place + 0.2 + 0.6 * uniform(code, 2)) * 13.0
    rim = shapes.box(away_x, away_z, 0.33, 0.33, feet[0]) - 0.7 * shapes.box(away_x, away_z, 0.25, 0.25, feet[0])
    slots = 0.6 * shapes.box(away_x, shapes.repeated(away_z, 0.12), 0.22, 0.03, feet[1])
    return (uniform(code, 3) < 0.8) * np.clip(rim + slots * (np.abs(away_z) < 0.24), 0, 1)


def _pavement(seed: int, colour: Array, x: Array, z: Array, feet: tuple[Array, Array], rough: Array) -> Array:
    """(3, N) with kerbs and the slabs beyond them."""
    beyond = shapes.stripe(np.abs(x) - ROAD_HALF_M - 10, 10, feet[0])
    slab = tiles(salted(seed, 6), x, z, (0.6, 0.9), feet) - 0.5
    joint = np.maximum(
        shapes.stripe(shapes.repeated(x, 0.6), 0.012, feet[0]), shapes.stripe(shapes.repeated(z, 0.9), 0.012, feet[1])
    )
    tone = (0.55 + 0.22 * slab + 0.22 * rough) * (1 - 0.5 * joint)
    colour = shapes.blend(colour, rgb(1.0, 0.96, 0.9) * tone, beyond)
    kerb = shapes.stripe(np.abs(x) - ROAD_HALF_M - 0.09, 0.09, feet[0])
    stones = 0.72 + 0.25 * rough - 0.3 * shapes.stripe(shapes.repeated(z, 1.0), 0.012, feet[1])
    return shapes.blend(colour, rgb(1.0, 1.0, 0.98) * stones, kerb)
