"""What a parcel of land may be: one line of numbers a kind, and which kinds each land use is made of."""

from typing import NamedTuple

import numpy as np

from diffnav.data.scenery.districts import COMMERCE, FARMLAND, GREEN, SETTLEMENT, WOODLAND


class Kind(NamedTuple):
    """The looks of a parcel.

    colour: mean RGB in [0, 1]. row_m: distance of its rows, metres. rows: their contrast, relative. tram:
    contrast of tyre tracks 14 m apart. mottle: of patches of 3-100 m. grain: of texture of 0.2-2 m. beds: of
    small beds of 3 x 7 m. trees, bushes: share of tree and bush cells that are taken. buildings: 0 none, 1 a
    house and a shed, 2 a farmstead, 3 halls.
    """

    colour: tuple[float, float, float]
    row_m: float = 1.0
    rows: float = 0.0
    tram: float = 0.0
    mottle: float = 0.22
    grain: float = 0.30
    beds: float = 0.0
    trees: float = 0.0
    bushes: float = 0.0
    buildings: int = 0


PLOUGHED = Kind((0.46, 0.39, 0.32), row_m=1.1, rows=0.10, mottle=0.26, grain=0.36)
SEEDLINGS = Kind((0.43, 0.42, 0.29), row_m=1.5, rows=0.13, tram=0.15, grain=0.34)
GREEN_CROP = Kind((0.33, 0.41, 0.23), row_m=0.8, rows=0.07, tram=0.30, grain=0.34)
RIPE_CROP = Kind((0.63, 0.56, 0.38), row_m=0.7, rows=0.05, tram=0.22, grain=0.26)
STUBBLE = Kind((0.58, 0.52, 0.39), row_m=4.2, rows=0.08, tram=0.06, grain=0.30)
MAIZE = Kind((0.27, 0.36, 0.19), row_m=0.9, rows=0.16, grain=0.42)
MEADOW = Kind((0.38, 0.44, 0.26), row_m=6.0, rows=0.02, mottle=0.26, grain=0.34, trees=0.02, bushes=0.015)
FALLOW = Kind((0.43, 0.44, 0.30), mottle=0.34, grain=0.44, trees=0.10, bushes=0.28)
VINEYARD = Kind((0.42, 0.42, 0.27), row_m=2.3, rows=0.30, grain=0.36)
POLYTUNNELS = Kind((0.66, 0.67, 0.67), row_m=6.5, rows=0.22, mottle=0.08, grain=0.12)
ALLOTMENTS = Kind((0.40, 0.41, 0.28), row_m=0.9, rows=0.06, beds=0.34, grain=0.40, trees=0.05, bushes=0.20)
GARDEN = Kind((0.37, 0.43, 0.26), mottle=0.30, grain=0.40, beds=0.10, trees=0.13, bushes=0.20, buildings=1)
PAVED_GARDEN = Kind((0.50, 0.48, 0.43), mottle=0.14, grain=0.24, beds=0.14, trees=0.06, bushes=0.12, buildings=1)
FARMSTEAD = Kind((0.50, 0.47, 0.40), mottle=0.34, grain=0.36, trees=0.06, bushes=0.05, buildings=2)
HALL = Kind((0.47, 0.46, 0.45), mottle=0.11, grain=0.18, trees=0.02, bushes=0.03, buildings=3)
PARKING = Kind((0.40, 0.40, 0.41), mottle=0.10, grain=0.17, trees=0.04)
STORAGE_YARD = Kind((0.50, 0.47, 0.42), mottle=0.34, grain=0.34, beds=0.30, bushes=0.02)
WOOD = Kind((0.23, 0.28, 0.17), mottle=0.40, grain=0.55, trees=0.97, bushes=0.70)
CLEARING = Kind((0.42, 0.42, 0.28), mottle=0.36, grain=0.48, trees=0.15, bushes=0.45)
PARK = Kind((0.37, 0.45, 0.25), row_m=5.0, rows=0.03, mottle=0.28, grain=0.32, trees=0.28, bushes=0.10)
PITCH = Kind((0.35, 0.46, 0.25), row_m=9.0, rows=0.07, mottle=0.14, grain=0.26)
POND = Kind((0.36, 0.43, 0.25), mottle=0.30, grain=0.40, trees=0.14, bushes=0.40)

KINDS = (
    PLOUGHED,
    SEEDLINGS,
    GREEN_CROP,
    RIPE_CROP,
    STUBBLE,
    MAIZE,
    MEADOW,
    FALLOW,
    VINEYARD,
    POLYTUNNELS,
    ALLOTMENTS,
    GARDEN,
    PAVED_GARDEN,
    FARMSTEAD,
    HALL,
    PARKING,
    STORAGE_YARD,
    WOOD,
    CLEARING,
    PARK,
    PITCH,
    POND,
)
COLUMNS = {name: np.array([getattr(k, name) for k in KINDS], np.float32) for name in Kind._fields}

# Sixteen equally likely kinds a land use: a hash's first four bits choose.
FIELDS = [PLOUGHED] * 3 + [SEEDLINGS] * 2 + [GREEN_CROP] * 2 + [RIPE_CROP] * 2 + [STUBBLE, MAIZE] + [MEADOW] * 2
MIXTURES = {
    FARMLAND: [*FIELDS, FALLOW, VINEYARD, FARMSTEAD],
    SETTLEMENT: [GARDEN] * 11 + [PAVED_GARDEN] * 4 + [ALLOTMENTS],
    WOODLAND: [WOOD] * 12 + [CLEARING] * 3 + [POND],
    GREEN: [PARK] * 4 + [MEADOW] * 3 + [PITCH] * 3 + [ALLOTMENTS] * 2 + [FALLOW, WOOD, POND, PARKING],
    COMMERCE: [HALL] * 8 + [PARKING] * 4 + [STORAGE_YARD] * 2 + [FALLOW, POLYTUNNELS],
}
MIXTURE_TABLE = np.array([[KINDS.index(kind) for kind in MIXTURES[use]] for use in sorted(MIXTURES)])


def index(kind: Kind) -> int:
    """Row of a kind in COLUMNS."""
    return KINDS.index(kind)
