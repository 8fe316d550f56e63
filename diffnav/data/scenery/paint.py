"""The colour of the world at points: ground, water, roads, shadows, roofs, crowns, from the bottom up."""

import numpy as np

from diffnav.data.scenery import shapes
from diffnav.data.scenery.buildings import buildings, seen
from diffnav.data.scenery.ground import GROUND_NOISE, edges, ground, pitches, rgb, water, water_m
from diffnav.data.scenery.layout import layout
from diffnav.data.scenery.noise import Array, hash_cells, octaves, salted, uniform
from diffnav.data.scenery.roads import parking, roads
from diffnav.data.scenery.roofs import roofs, shadows, terraces
from diffnav.data.scenery.trees import BUSHES, TREES, crowns

# Skylight is bluer than sunlight.
SHADE = rgb(0.40, 0.44, 0.51)


def colours(world: int, x: Array, y: Array, footprint_m: Array) -> Array:
    """(3, N) float32 RGB in [0, 1] of the world at N points.

    x, y: (N,) float64, metres east and north. footprint_m: (N,) float32, side of the ground patch each point
    stands for; details below it are averaged away.
    """
    # Lenses and demosaicing blur a little more than one pixel's box.
    footprint_m = footprint_m * np.float32(1.3)
    noise, tint = octaves(salted(world, GROUND_NOISE), x, y, footprint_m)
    land = layout(world, x, y)
    colour = edges(ground(land, noise, tint, footprint_m), land, noise, footprint_m)
    colour = stones(colour, world, x, y, footprint_m)
    built = buildings(world, land.parcels)
    near = seen(land, built)
    colour = terraces(colour, near, noise, footprint_m)
    colour = pitches(colour, land, footprint_m)
    colour = parking(colour, land, footprint_m)
    colour = water(colour, water_m(land, noise), x, y, noise, footprint_m)
    colour = roads(colour, land, noise, footprint_m)
    trees = crowns(world, x, y, TREES, noise, footprint_m)
    bushes = crowns(world, x, y, BUSHES, noise, footprint_m)
    colour = shapes.blend(colour, bushes.colour, bushes.cover)
    shade = np.maximum(trees.shadow, bushes.shadow * (1 - bushes.cover))
    shade = np.maximum(shade, shadows(near, footprint_m))
    colour = colour * (1 - (1 - SHADE) * shade)
    colour = roofs(colour, near, noise, footprint_m)
    colour = shapes.blend(colour, trees.colour, trees.cover)
    return tone(colour)


def stones(colour: Array, world: int, x: Array, y: Array, footprint_m: Array) -> Array:
    """(3, N) with pale stones, blossoms and litter strewn about, one at most in each square of 2.5 m."""
    cell = 2.5
    i, j = np.floor(x / cell), np.floor(y / cell)
    code = hash_cells(salted(world, 70), i.astype(np.int64), j.astype(np.int64))
    radius = 0.12 + 0.28 * uniform(code, 1) ** 3
    fx = (x - (i + 0.25 + 0.5 * uniform(code, 2)) * cell).astype(np.float32)
    fy = (y - (j + 0.25 + 0.5 * uniform(code, 3)) * cell).astype(np.float32)
    there = uniform(code, 4) < 0.10
    cover = there * shapes.box(fx, fy, radius, 0.8 * radius, footprint_m)
    dark = there * shapes.box(fx - 0.3 * radius - 0.1, fy - 0.3 * radius - 0.1, radius, radius, footprint_m)
    pale = np.where(uniform(code, 5) < 0.4, np.float32(0.95), np.float32(0.70))
    return shapes.blend(colour * (1 - 0.4 * dark), rgb(1.0, 0.98, 0.92) * pale, cover)


def tone(colour: Array) -> Array:
    """(3, N) in [0, 1]: a sensor's response, straight in the middle, with a soft shoulder at white."""
    grey = colour.mean(0)
    # Haze between ground and camera pales colours and lifts the shadows.
    colour = 1.10 * np.maximum(grey + 0.78 * (colour - grey), 0.0) + rgb(0.018, 0.022, 0.028)
    knee = np.float32(0.75)
    high = np.maximum(colour - knee, 0.0)
    return np.clip(np.minimum(colour, knee) + high / (1 + 1.2 * high), 0.0, 1.0).astype(np.float32)
