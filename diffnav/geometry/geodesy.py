"""Distances, bearings and local metres on the earth, taken as a sphere (Eq. 11).

A place is latitude, longitude in degrees; arrays (..., 2) float64, whose leading dimensions broadcast; longitudes may
lie any number of turns away. A latitude outside [-90, 90] or a value that is not finite raises ValueError.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# Mean radius of the earth (IUGG); the sphere is within .6 % of the ellipsoid's distances.
EARTH_RADIUS_M = 6_371_008.8


def haversine_m(a: ArrayLike, b: ArrayLike) -> Array:
    """Great-circle distances in metres between places a and b, both (..., 2): (...).

    Exact to rounding from zero up to the antipode: the root of Eq. 11 has an arcsine that loses half of its digits
    there, so its complement, the same formula for the antipode of b, goes with it into an arctangent.
    Source: Eq. 11.
    """
    a, b = _places(a), _places(b)
    latitude_a, latitude_b = np.radians(a[..., 0]), np.radians(b[..., 0])
    turn = np.radians(b[..., 1] - a[..., 1])
    product = np.cos(latitude_a) * np.cos(latitude_b)
    near = np.sin((latitude_b - latitude_a) / 2) ** 2 + product * np.sin(turn / 2) ** 2
    far = np.sin((latitude_b + latitude_a) / 2) ** 2 + product * np.cos(turn / 2) ** 2
    return 2 * EARTH_RADIUS_M * np.arctan2(np.sqrt(near), np.sqrt(far))


def offset_m(origin: ArrayLike, latlon: ArrayLike) -> Array:
    """Metres east and north of `origin` (..., 2) at which places (..., 2) lie: (..., 2).

    The plane keeps distance and direction as seen from the origin (azimuthal equidistant): the length is
    `haversine_m`, the direction `bearing_deg`. The antipode, which lies in every direction, is put in the north.
    """
    direction, cosine = _direction(_places(origin), _places(latlon))
    sine = np.hypot(direction[..., 0], direction[..., 1])
    angle = np.arctan2(sine, cosine)
    unit = np.where(sine[..., None] > 0, direction / np.where(sine > 0, sine, 1)[..., None], [0.0, 1.0])
    return EARTH_RADIUS_M * angle[..., None] * unit


def moved(origin: ArrayLike, offset: ArrayLike) -> Array:
    """The places (..., 2) at offsets (..., 2) in metres east, north of `origin` (..., 2): inverse of `offset_m`.

    Longitudes come out in [-180, 180).
    """
    origin, offset = _places(origin), np.asarray(offset, np.float64)
    if offset.shape[-1:] != (2,) or not np.isfinite(offset).all():
        raise ValueError(f"need finite offsets (..., 2) in metres, got shape {offset.shape}")
    latitude = np.radians(origin[..., 0])
    angle = np.hypot(offset[..., 0], offset[..., 1]) / EARTH_RADIUS_M
    # np.sinc(x) is sin(pi x) / (pi x): no division by the length of a zero offset.
    step = offset * (np.sinc(angle / np.pi) / EARTH_RADIUS_M)[..., None]
    along = np.cos(latitude) * np.cos(angle) - np.sin(latitude) * step[..., 1]
    up = np.sin(latitude) * np.cos(angle) + np.cos(latitude) * step[..., 1]
    reached = np.degrees(np.arctan2(up, np.hypot(along, step[..., 0])))
    longitude = origin[..., 1] + np.degrees(np.arctan2(step[..., 0], along))
    return np.stack([reached, wrapped_deg(longitude)], -1)


def bearing_deg(a: ArrayLike, b: ArrayLike) -> Array:
    """Compass bearings in [0, 360) at which one leaves a (..., 2) for b (..., 2), clockwise from north; 0 if equal."""
    direction, _ = _direction(_places(a), _places(b))
    bearing = np.degrees(np.arctan2(direction[..., 0], direction[..., 1])) % 360
    # The remainder of a tiny negative number rounds to 360 itself.
    return np.where(bearing >= 360, 0.0, bearing)


def wrapped_deg(angle: ArrayLike) -> Array:
    """Angles in degrees brought into [-180, 180) by whole turns; those inside already are not touched."""
    angle = np.asarray(angle, np.float64)
    wrapped = angle - 360 * np.floor((angle + 180) / 360)
    return np.where(wrapped >= 180, -180.0, wrapped)


def _direction(a: Array, b: Array) -> tuple[Array, Array]:
    """(east, north) (..., 2) of b's unit vector in the tangent plane of a, and the cosine of the angle between them.

    Written with the differences of the angles, so that places a millimetre apart keep their digits.
    """
    latitude_a, latitude_b = np.radians(a[..., 0]), np.radians(b[..., 0])
    rise = np.radians(b[..., 0] - a[..., 0])
    turn = np.radians(wrapped_deg(b[..., 1] - a[..., 1]))
    bend = 2 * np.cos(latitude_b) * np.sin(turn / 2) ** 2
    east = np.cos(latitude_b) * np.sin(turn)
    north = np.sin(rise) + np.sin(latitude_a) * bend
    return np.stack([east, north], -1), np.cos(rise) - np.cos(latitude_a) * bend


def _places(latlon: ArrayLike) -> Array:
    places = np.asarray(latlon, np.float64)
    if places.shape[-1:] != (2,):
        raise ValueError(f"need places (..., 2) of latitude, longitude, got shape {places.shape}")
    if not np.isfinite(places).all():
        raise ValueError("latitude and longitude must be finite numbers")
    beyond = np.abs(places[..., 0]) > 90
    if beyond.any():
        raise ValueError(f"latitude must be from -90 to 90 degrees, got {places[..., 0][beyond].flat[0]:g}")
    return places
